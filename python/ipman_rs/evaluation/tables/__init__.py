"""Predictions against a data set, and the tables of the paper: what `ipman evaluate` does."""

from .job import Job, Shard, Source
from .paper import TABLES, Table
from .predictions import Predictions, read
from .run import Evaluation, evaluate, evaluation
from .summary import Difference, Measured, difference, measured

__all__ = [
    "TABLES",
    "Difference",
    "Evaluation",
    "Job",
    "Measured",
    "Predictions",
    "Shard",
    "Source",
    "Table",
    "difference",
    "evaluate",
    "evaluation",
    "measured",
    "read",
]
