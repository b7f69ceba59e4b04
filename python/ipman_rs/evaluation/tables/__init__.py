"""Predictions against a data set, and the tables of the paper: what `ipman evaluate` does."""

from ipman_rs.renamed import old_names

from .job import Job, Shard, Source
from .paper import TABLES, Table
from .predictions import Predictions, read
from .run import Evaluation, evaluate, evaluation
from .summary import Difference, MethodSummary, difference, summarise

__all__ = [
    "TABLES",
    "Difference",
    "Evaluation",
    "Job",
    "MethodSummary",
    "Predictions",
    "Shard",
    "Source",
    "Table",
    "difference",
    "evaluate",
    "evaluation",
    "read",
    "summarise",
]

__getattr__ = old_names(__name__, {"Measured": "MethodSummary", "measured": "summarise"})
