"""Names that were changed still work under the old ones, with a warning."""

from __future__ import annotations

from importlib import import_module

import pytest

RENAMED = {
    "ipman_rs.evaluation": {"Comparison": "PairedComparison"},
    "ipman_rs.evaluation.tables": {"Measured": "MethodSummary", "measured": "summarise"},
    "ipman_rs.validation": {"Comparison": "MeasuredComparison"},
    "ipman_rs.data.check": {"demanded": "require_plausible", "of_frames": "check_frames"},
    "ipman_rs.io": {"Recording": "BodySequence"},
    "ipman_rs.data.tracks": {"Named": "MarkerColumns", "named": "select_markers"},
}


@pytest.mark.parametrize(
    ("module", "old", "new"), [(module, old, new) for module, names in RENAMED.items() for old, new in names.items()]
)
def test_old_name_is_the_new_one(module, old, new):
    package = import_module(module)
    with pytest.warns(DeprecationWarning, match=f"^{module}.{old} is now {module}.{new}$"):
        assert getattr(package, old) is getattr(package, new)


def test_other_names_are_not_there():
    with pytest.raises(AttributeError, match="'ipman_rs.evaluation' has no attribute 'compared'"):
        import_module("ipman_rs.evaluation").compared  # noqa: B018
