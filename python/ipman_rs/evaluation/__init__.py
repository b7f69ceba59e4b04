"""Metrics of estimated bodies: their errors, their balance, and the statistics of differences between methods.

Metrics take numpy arrays or torch tensors and return one number per body, (...), in metres, radians or shares; NaN
where a metric is undefined (`numpy_or_torch`). `Accumulator` sums them over shards, exactly.
"""

from ipman_rs.renamed import old_names

from .body_errors import BodyErrors, body_errors
from .bose import BoseMode, bose
from .com_error import com_error
from .cop_error import cop_error
from .foot_skating import foot_skating
from .moyo_protocol import MoyoFigures, PressureFigures, moyo
from .mpjpe import mpjpe, pa_mpjpe
from .penetration import hover, lowest, penetration
from .pressure_iou import PressureMode, frame_difference, pressure_iou
from .pressure_map import Mat, pressure_map
from .procrustes import aligned, similarity
from .pve import pve
from .reasons import reasons
from .statistics.accumulator import Accumulator
from .statistics.bootstrap import Interval, bootstrap, paired
from .statistics.comparison import PairedComparison, compare
from .statistics.metric_sums import Summary
from .statistics.permutation_test import paired_test, sign_flip
from .tilt import root_tilt, tilt

__all__ = [
    "Accumulator",
    "BodyErrors",
    "BoseMode",
    "Interval",
    "Mat",
    "MoyoFigures",
    "PairedComparison",
    "PressureFigures",
    "PressureMode",
    "Summary",
    "aligned",
    "body_errors",
    "bootstrap",
    "bose",
    "com_error",
    "compare",
    "cop_error",
    "foot_skating",
    "frame_difference",
    "hover",
    "lowest",
    "moyo",
    "mpjpe",
    "pa_mpjpe",
    "paired",
    "paired_test",
    "penetration",
    "pressure_iou",
    "pressure_map",
    "pve",
    "reasons",
    "root_tilt",
    "sign_flip",
    "similarity",
    "tilt",
]

__getattr__ = old_names(__name__, {"Comparison": "PairedComparison"})
