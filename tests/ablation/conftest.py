"""The ablation of training uses what its tests share."""

from tests.training.conftest import _one_thread, posing, static  # noqa: F401
