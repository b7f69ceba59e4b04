"""The quantities of `ipman_rs` on tensors, differentiable in the vertices.

CPU tensors are computed by the compiled core, tensors on other devices by the plain-torch formulas in `reference`.
"""

from ipman_rs import BaseOfSupport as BaseOfSupport
from ipman_rs import BodyTemplate as BodyTemplate
from ipman_rs import MassProperties as MassProperties

from . import reference as reference
from .analysis import Analysis as Analysis
from .analysis import analyze as analyze
from .analysis import body_status as body_status
from .body import BodyModel as BodyModel
from .camera import camera_to_world as camera_to_world
from .ground import Ground as Ground
from .losses import *  # noqa: F403 - its __all__
from .mass import center_of_mass as center_of_mass
from .physics_loss import IntuitivePhysicsLoss as IntuitivePhysicsLoss
from .pressure import center_of_pressure as center_of_pressure
from .pressure import pressure as pressure
from .sampling import sample_surface as sample_surface
from .self_contact import self_contact_loss as self_contact_loss
from .support import base_of_support as base_of_support
from .support import bose as bose
from .support import support_margin as support_margin
from .volume import mass_properties as mass_properties
from .volume import part_volumes as part_volumes
