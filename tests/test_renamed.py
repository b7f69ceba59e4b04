"""Names that were changed still work under the old ones, with a warning."""

from __future__ import annotations

from importlib import import_module

import pytest

RENAMED = {
    "ipman_rs.ablation.fitting.run": {"Benchmark": "FittingBenchmark"},
    "ipman_rs.ablation.training.run": {"Benchmark": "TrainingBenchmark"},
    "ipman_rs.evaluation": {"Comparison": "PairedComparison"},
    "ipman_rs.evaluation.tables": {"Measured": "MethodSummary", "measured": "summarise"},
    "ipman_rs.validation": {"Comparison": "MeasuredComparison"},
    "ipman_rs.data.check": {"demanded": "require_plausible", "of_frames": "check_frames"},
    "ipman_rs.io": {"Recording": "BodySequence"},
    "ipman_rs.data.tracks": {"Named": "MarkerColumns", "named": "select_markers"},
    "ipman_rs.simulation": {"Comparison": "MethodComparison"},
    "ipman_rs.study": {"Camera": "ViewCamera"},
    "ipman_rs.fitting.detection_problem": {"problem": "problem_from_detections"},
    "ipman_rs.fitting.marker_fit": {"Recorded": "MarkerFit"},
    "ipman_rs.fitting.result": {"results": "fit_results"},
    "ipman_rs.fitting.solvers": {"Options": "SolverOptions"},
    "ipman_rs.fitting.start": {"begin": "initial_state"},
    "ipman_rs.training.losses": {"Physics": "PhysicsLoss"},
}
NEED_TORCH = ("ipman_rs.ablation.", "ipman_rs.fitting.", "ipman_rs.training.")


@pytest.mark.parametrize(
    ("module", "old", "new"), [(module, old, new) for module, names in RENAMED.items() for old, new in names.items()]
)
def test_old_name_is_the_new_one(module, old, new):
    if module.startswith(NEED_TORCH):
        pytest.importorskip("torch", reason="torch is an extra")
    package = import_module(module)
    with pytest.warns(DeprecationWarning, match=f"^{module}.{old} is now {module}.{new}$"):
        assert getattr(package, old) is getattr(package, new)


def test_other_names_are_not_there():
    with pytest.raises(AttributeError, match="'ipman_rs.evaluation' has no attribute 'compared'"):
        import_module("ipman_rs.evaluation").compared  # noqa: B018
