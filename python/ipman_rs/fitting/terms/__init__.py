"""The terms of fitting objectives, one per file. A new term is one file and one line here."""

from __future__ import annotations

from .bending import Bending
from .bone_directions import BoneDirections
from .contact_normals import ContactNormals
from .expression_prior import ExpressionPrior
from .flat_soles import FlatSoles
from .gmm_prior import GaussianMixture
from .hand_prior import HandPrior
from .jaw_prior import JawPrior
from .joint_limits import JointLimits
from .measured_shape import MeasuredShape
from .physics import BalanceTerm, GroundTerm, StabilityTerm
from .points_3d import Points3D
from .pose_prior import PosePrior
from .presented_contact import PresentedContact
from .presented_orient import PresentedOrient
from .presented_pose import PresentedPose
from .reprojection import Reprojection
from .seat import Seat
from .segment_balance import SegmentBalance
from .self_contact import SelfContactTerm, SelfPenetrationTerm
from .shape_prior import ShapePrior
from .term import LeastSquares, Term
from .vposer import VPoser

TERMS: dict[str, type[Term]] = {
    "reprojection": Reprojection,
    "points_3d": Points3D,
    "bone_directions": BoneDirections,
    "joint_limits": JointLimits,
    "pose_prior": PosePrior,
    "gmm_prior": GaussianMixture,
    "vposer": VPoser,
    "presented_pose": PresentedPose,
    "presented_orient": PresentedOrient,
    "presented_contact": PresentedContact,
    "shape_prior": ShapePrior,
    "measured_shape": MeasuredShape,
    "bending": Bending,
    "hand_prior": HandPrior,
    "jaw_prior": JawPrior,
    "expression_prior": ExpressionPrior,
    "flat_soles": FlatSoles,
    "stability": StabilityTerm,
    "ground": GroundTerm,
    "balance": BalanceTerm,
    "seat": Seat,
    "segment_balance": SegmentBalance,
    "self_contact": SelfContactTerm,
    "self_penetration": SelfPenetrationTerm,
    "contact_normals": ContactNormals,
}

# What stands in a world with a floor: they need a ground, and hold a body up.
PHYSICS = ("stability", "balance", "ground", "flat_soles", "segment_balance", "seat")

__all__ = ["PHYSICS", "TERMS", "LeastSquares", "Term"]
