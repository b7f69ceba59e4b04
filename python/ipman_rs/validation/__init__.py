"""Fitted bodies against measurements: force plates, and centres of mass by others.

compared = MeasuredComparison("squats", times, computed(bodies, template, plates), plates, reference)
figures(compared)["mass"]                  # plain values; `report` makes tables of them
"""

from ipman_rs.renamed import old_names

from .acceleration import accelerations
from .comparison import MeasuredComparison
from .computed import Computed, computed
from .figures import figures
from .zero_moment_point import along_force, zero_moment_point, zero_moment_point_of_parts

__all__ = [
    "Computed",
    "MeasuredComparison",
    "accelerations",
    "along_force",
    "computed",
    "figures",
    "zero_moment_point",
    "zero_moment_point_of_parts",
]

__getattr__ = old_names(__name__, {"Comparison": "MeasuredComparison"})
