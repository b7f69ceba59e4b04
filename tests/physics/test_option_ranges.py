"""Options and weights are finite and in their range, whatever kind of number they are; tensors are ordinary ones."""

import warnings

import numpy as np
import pytest

import ipman_rs as ip

BODY = ip.load_body("anny-lite")
VERTICES = np.asarray(ip.body.posed(BODY, "standing"))
GROUND = ip.Ground.y_up()

# Each option with whether zero is in its range.
OPTIONS = [
    ("stability_loss", "alpha", True), ("stability_loss", "gamma", True), ("stability_loss", "epsilon", True),
    ("ground_loss", "alpha1", True), ("ground_loss", "alpha2", False), ("ground_loss", "beta1", True),
    ("ground_loss", "beta2", False), ("balance_cost", "gamma", True), ("balance_cost", "sigma", False),
    ("pressure", "alpha", True), ("pressure", "gamma", True), ("center_of_pressure", "gamma", True),
    ("support_margin", "threshold", False), ("base_of_support", "threshold", False), ("body_status", "threshold",
    False),
    ("binary_center_of_pressure", "threshold", False),
]  # fmt: skip
NO_NUMBERS = [
    10**400,
    -(10**400),
    10**5000,
    float("nan"),
    float("inf"),
    1e308,
    -1.0,
    np.longdouble("1e400"),
    np.float64("nan"),
]
NOTHING = [None, "1", True, np.timedelta64(1), np.datetime64("2020-01-01"), 1j, [1.0], np.array([0.1]), object()]


@pytest.mark.parametrize(("function", "option", "has_zero"), OPTIONS)
def test_numpy_options(function, option, has_zero):
    call = getattr(ip, function)
    for value in [*NO_NUMBERS, *([] if has_zero else [0.0, 5e-324])]:
        with pytest.raises(ValueError, match=f"^{option}: "):
            call(VERTICES, BODY.template, GROUND, **{option: value})
    for value in NOTHING:
        with pytest.raises(TypeError, match=f"^{option}: "):
            call(VERTICES, BODY.template, GROUND, **{option: value})
    call(VERTICES, BODY.template, GROUND, **{option: np.int64(1)})


def test_refusals_are_short_and_name_the_argument():
    with pytest.raises(ValueError, match=r"^num_samples: expected 1 to 10000000, got .{1,90}$"):
        ip.BodyTemplate(BODY.v_template, BODY.faces, num_samples=10**300)
    with pytest.raises(TypeError, match="^num_samples: "):
        ip.BodyTemplate(BODY.v_template, BODY.faces, num_samples=np.timedelta64(10))  # type: ignore[arg-type]
    for density in (1e308, 0.0, -1.0, np.nan, 1e-320):
        with pytest.raises(ValueError, match="^density: "):
            ip.mass_properties(VERTICES, BODY.template, density)


def test_coordinates_at_the_end_of_the_range_leak_no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warnings.simplefilter("ignore", ip.UnitsWarning)
        for vertices in (
            VERTICES.astype(float) * 5e307,
            np.where(VERTICES > 0, 1.7e308, -1.7e308),
            VERTICES.astype(np.longdouble) * np.longdouble("1e400"),
        ):
            ip.analyze(vertices, BODY.template, GROUND)
            ip.binary_center_of_pressure(vertices, BODY.template, GROUND)
            ip.body_status(vertices, BODY.template, GROUND)
            GROUND.signed_height(vertices)
            GROUND.project(vertices)


torch = pytest.importorskip("torch", reason="torch is an extra")
ipt = pytest.importorskip("ipman_rs.torch")
TENSOR = torch.from_numpy(VERTICES.copy())[None].float()

SPECIAL = {
    "sparse": lambda: TENSOR.to_sparse(),
    "sparse_csr": lambda: TENSOR[0].to_sparse_csr(),
    "meta": lambda: TENSOR.to("meta"),
    "nested": lambda: torch.nested.nested_tensor([TENSOR[0], TENSOR[0]]),
    "quantised": lambda: torch.quantize_per_tensor(TENSOR, 0.1, 0, torch.qint8),
    "float8": lambda: TENSOR.to(torch.float8_e4m3fn),
    "int64": lambda: TENSOR.long(),
    "complex": lambda: TENSOR.to(torch.complex64),
    "None": lambda: None,
    "float": lambda: 1.0,
    "ndarray": lambda: VERTICES,
}
QUANTITIES = ["stability_loss", "base_of_support", "bose", "body_status", "analyze", "support_margin", "pressure"]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", SPECIAL)
def test_special_tensors_are_refused_by_name(kind):
    vertices = SPECIAL[kind]()
    for name in QUANTITIES:
        with pytest.raises(TypeError, match="^vertices: expected"):
            getattr(ipt, name)(vertices, BODY.template, GROUND)
    for name in ("sample_surface", "mass_properties", "center_of_mass", "self_contact_loss"):
        with pytest.raises(TypeError, match="^vertices: expected"):
            getattr(ipt, name)(vertices, BODY.template)
    with pytest.raises(TypeError, match="^vertices: expected"):
        ipt.bose(vertices, BODY.template, GROUND, method="lp")
    with pytest.raises(TypeError, match="^vertices: expected"):
        ipt.IntuitivePhysicsLoss(BODY.template)(vertices, GROUND)
    if kind not in ("int64", "ndarray", "float"):
        with pytest.raises(TypeError, match="^normal: expected"):
            ipt.Ground(vertices) if kind != "None" else ipt.Ground(None)


def test_weights_that_no_gradient_survives():
    for weight in NO_NUMBERS:
        with pytest.raises(ValueError, match="^weights: pull: "):
            ipt.IntuitivePhysicsLoss(BODY.template, weights={"pull": weight})


def test_weights_and_masks_of_other_kinds():
    for weight in NOTHING:
        with pytest.raises(TypeError, match="^weights: pull: "):
            ipt.IntuitivePhysicsLoss(BODY.template, weights={"pull": weight})
    with pytest.raises(TypeError, match="^weights: "):
        ipt.IntuitivePhysicsLoss(BODY.template, weights=[1.0])  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="^template: "):
        ipt.IntuitivePhysicsLoss(None)  # type: ignore[arg-type]
    loss = ipt.IntuitivePhysicsLoss(BODY.template)
    for mask in ([True], True, np.array([True]), torch.tensor([True]).to_sparse()):
        with pytest.raises(TypeError, match="^valid: "):
            loss(TENSOR, GROUND, mask)


@pytest.mark.parametrize("option", ["alpha", "gamma"])
def test_torch_options(option):
    for value in NO_NUMBERS:
        with pytest.raises(ValueError, match=f"^{option}: "):
            ipt.stability_loss(TENSOR, BODY.template, GROUND, **{option: value})
    with pytest.raises(TypeError, match=f"^{option}: "):
        ipt.stability_loss(TENSOR, BODY.template, GROUND, **{option: np.timedelta64(1)})


def test_torch_grounds_of_numbers_that_are_none():
    for height in (10**400, np.longdouble("1e400"), float("nan"), None, "0"):
        with pytest.raises((ValueError, TypeError), match="^height: "):
            ipt.Ground(height=height)
