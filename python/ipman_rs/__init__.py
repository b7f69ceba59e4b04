"""Intuitive physics of 3D human bodies: volume, centre of mass, pressure, support and balance, with exact gradients.

The functions here take numpy arrays; `ipman_rs.torch` has the same names on tensors, with autograd.
Importing this package needs numpy alone.
"""

from ipman_rs import body, losses, presets
from ipman_rs._core import __version__, get_num_threads, set_num_threads
from ipman_rs.analysis import Analysis, analyze, analyze_poses
from ipman_rs.body import load_body
from ipman_rs.ground import Ground
from ipman_rs.mass import center_of_mass
from ipman_rs.pressure import binary_center_of_pressure, center_of_pressure, pressure
from ipman_rs.sampling import sample_surface
from ipman_rs.self_contact import SelfPenetration, self_contact_distance, self_contact_loss, self_penetration
from ipman_rs.status import Status, body_status
from ipman_rs.support import BaseOfSupport, base_of_support, bose, support_margin
from ipman_rs.template import BodyTemplate
from ipman_rs.units import UnitsWarning
from ipman_rs.volume import MassProperties, mass_properties, part_volumes

from .losses import *  # noqa: F403 - its __all__

__all__ = [
    "Analysis",
    "BaseOfSupport",
    "BodyTemplate",
    "Ground",
    "MassProperties",
    "SelfPenetration",
    "Status",
    "UnitsWarning",
    "__version__",
    "analyze",
    "analyze_poses",
    "base_of_support",
    "binary_center_of_pressure",
    "body",
    "body_status",
    "bose",
    "center_of_mass",
    "center_of_pressure",
    "get_num_threads",
    "load_body",
    "mass_properties",
    "part_volumes",
    "presets",
    "pressure",
    "sample_surface",
    "self_contact_loss",
    "self_contact_distance",
    "self_penetration",
    "set_num_threads",
    "support_margin",
]
__all__ += losses.__all__
