"""Fitted bodies against measurements: force plates, and centres of mass by others.

compared = Comparison("squats", times, computed(bodies, template, plates), plates, reference)
figures(compared)["mass"]                  # plain values; `report` makes tables of them
"""

from .acceleration import accelerations
from .comparison import Comparison
from .computed import Computed, computed
from .figures import figures
from .zero_moment_point import along_force, zero_moment_point, zero_moment_point_of_parts

__all__ = [
    "Comparison",
    "Computed",
    "accelerations",
    "along_force",
    "computed",
    "figures",
    "zero_moment_point",
    "zero_moment_point_of_parts",
]
