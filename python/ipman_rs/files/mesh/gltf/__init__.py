"""glTF 2.0, as .glb or .gltf: the surface of a scene, with morph targets and skins applied as its specification has it.

Colours, materials, cameras and lights have no part in a body's physics. Compressed meshes (Draco, meshopt) are refused.
"""

from .surface import parse

__all__ = ["parse"]
