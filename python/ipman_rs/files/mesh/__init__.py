"""Mesh files. `read_mesh.read_mesh(path)` reads .obj, .ply, .stl, .glb and .gltf files."""
