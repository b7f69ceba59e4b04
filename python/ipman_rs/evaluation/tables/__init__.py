"""Predictions against a data set, and the tables of the paper: what `ipman evaluate` does."""

from .job import Job, Shard, Source
from .paper import TABLES, Table
from .predictions import Predictions, read
from .summary import Difference, Measured, difference, measured

__all__ = [
    "TABLES",
    "Difference",
    "Job",
    "Measured",
    "Predictions",
    "Shard",
    "Source",
    "Table",
    "difference",
    "measured",
    "read",
]
