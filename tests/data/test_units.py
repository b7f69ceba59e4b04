"""Units of length, force and moment in the spellings of laboratories."""

from __future__ import annotations

import pytest

from ipman_rs.data.units import metres, newton_metres, newtons


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("mm", 1e-3), (" MM ", 1e-3), ("mete", 1), ("metr", 1), ("METER", 1), ("mill", 1e-3), ("millimeter", 1e-3),
     ("cent", 0.01), ("cm.", 0.01), ("µm", 1e-6), ("inch", 0.0254), ("ft", 0.3048), ("", None), ("me", None),
     ("deg", None), ("V", None), ("metersick", None), ("N", None)],
)  # fmt: skip
def test_lengths(unit, expected):
    assert metres(unit) == expected


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("N", 1), ("n", 1), ("nt", 1), ("Nt.", 1), ("Newtons", 1), ("newton", 1), ("Newt", 1), ("kN", 1000), ("", None),
     ("V", None), ("mV", None), ("Nm", None), ("bits", None)],
)  # fmt: skip
def test_forces(unit, expected):
    assert newtons(unit) == expected


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("Nmm", 1e-3), ("N-mm", 1e-3), ("N.mm", 1e-3), ("N*mm", 1e-3), ("N·mm", 1e-3), ("N⋅mm", 1e-3), ("N mm", 1e-3),
     ("ntmm", 1e-3), ("nt-mm", 1e-3), ("NewtonMillimeters", 1e-3), ("Newton-mm", 1e-3), ("Ncm", 0.01), ("Nm", 1),
     ("NM", 1), ("N m", 1), ("N·m", 1), ("ntm", 1), ("Newton meters", 1), ("Newton-metres", 1), ("Newtons meter", 1),
     ("kNm", 1000), ("Nmete", 1), ("m-Newton", 1), ("", None), ("N", None), ("nt", None), ("mm", None), ("V", None),
     ("N/m", None), ("mN", None)],
)  # fmt: skip
def test_moments(unit, expected):
    found = newton_metres(unit)
    assert found == (expected if expected is None else pytest.approx(expected, rel=1e-15))
