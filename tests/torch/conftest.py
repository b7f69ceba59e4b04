"""The one list of quantities and options that every parametrised test walks, and the bodies they are tried on."""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs import _core
from ipman_rs.quantities import Quantity
from ipman_rs.torch.dispatch import evaluate
from tests.helpers import model_arrays

METHODS = ("pcom", "vertex_mean", "sample_mean", "face_area", "exact")
GROUND_TERMS = tuple(itertools.product(("samples", "vertices"), ("tanh_squared", "tanh_of_square")))


@dataclass(frozen=True)
class Case:
    """A quantity by its full name with its options: K numbers a body."""

    quantity: str
    options: tuple[float, ...] = ()

    def __str__(self) -> str:
        return "-".join([self.quantity, *(f"{option:g}" for option in self.options)])

    def __call__(self, vertices: torch.Tensor, body: Body) -> torch.Tensor:
        """(..., V, 3) -> (..., K), along whichever path is in force."""
        return evaluate(vertices, body.template, body.ground, self.on(body))

    def on(self, body: Body) -> Quantity:
        """The quantity, its K numbers in a row."""
        name, *modes = self.quantity.split(".")
        return Quantity(name, tuple(modes), self.options, (self.size(body),))

    def size(self, body: Body) -> int:
        """K."""
        return _core.Quantity(body.template._core, self.quantity, self.options).num_outputs

    def reference(self, vertices: torch.Tensor, body: Body) -> torch.Tensor:
        with ipt.dispatch._reference_path():
            return self(vertices, body)


GROUND_OPTIONS = (1.0, 0.15, 10.0, 0.15)
SINGLE = [
    Case("part_volumes"),
    Case("mass_properties", (985.0,)),
    Case("sample_surface"),
    *(Case(f"center_of_mass.{method}") for method in METHODS),
    Case("pressure", (100.0, 10.0)),
    Case("center_of_pressure", (100.0, 10.0, 0.0)),
    Case("center_of_pressure", (100.0, 10.0, 1e-6)),
    *(Case(f"support_margin.{contact}.{method}", (0.1,)) for contact in ("paper", "released") for method in METHODS),
    *(Case(f"stability_loss.{method}", (100.0, 10.0, 0.0)) for method in METHODS),
    Case("stability_loss.pcom", (70.0, 10.0, 1e-6)),
    *(Case(f"ground_loss.{points}.{shape}", GROUND_OPTIONS) for points, shape in GROUND_TERMS),
    *(
        Case(f"balance_cost.{wrap}.{method}", (100.0, 50.0, 0.02))
        for wrap in ("log", "saturate", "none")
        for method in METHODS
    ),
]
FUSED = [
    *(
        Case(f"terms.stability.{method}.ground.{points}.{shape}", (100.0, 10.0, 0.0, *GROUND_OPTIONS))
        for method in METHODS
        for points, shape in GROUND_TERMS
    ),
    Case("terms.stability.pcom.ground.samples.tanh_squared", (100.0, 10.0, 1e-6, 1.0, 0.5, 1.0, 0.15)),
    *(
        Case(f"terms.balance.{wrap}.{method}.ground.{points}.{shape}", (100.0, 50.0, 0.02, *GROUND_OPTIONS))
        for wrap in ("log", "saturate", "none")
        for method in METHODS
        for points, shape in GROUND_TERMS
    ),
]
# Where a test costs seconds a case, one fused quantity of each kind stands for the product of its modes, and wraps and
# contact modes, which are a line each, are tried with the paper's centre of mass only.
MAIN = [
    case
    for case in SINGLE
    if not case.quantity.startswith(("balance_cost.saturate", "balance_cost.none", "support_margin.released"))
    or case.quantity.endswith("pcom")
] + [
    Case("terms.stability.pcom.ground.samples.tanh_squared", (100.0, 10.0, 0.0, *GROUND_OPTIONS)),
    Case("terms.stability.exact.ground.vertices.tanh_of_square", (100.0, 10.0, 1e-6, *GROUND_OPTIONS)),
    Case("terms.balance.log.pcom.ground.samples.tanh_squared", (100.0, 50.0, 0.02, *GROUND_OPTIONS)),
    Case("terms.balance.saturate.face_area.ground.vertices.tanh_squared", (100.0, 50.0, 0.02, *GROUND_OPTIONS)),
]
# One of each room.
ROOMS = [
    next(case for case in SINGLE + FUSED if case.quantity.startswith(room))
    for room in (
        "part_volumes",
        "mass_properties",
        "sample_surface",
        "center_of_mass",
        "pressure",
        "center_of_pressure",
        "support_margin",
        "stability_loss",
        "ground_loss",
        "balance_cost",
        "terms.stability",
        "terms.balance",
    )
]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    for name, cases in (("case", SINGLE + FUSED), ("main_case", MAIN), ("room", ROOMS)):
        if name in metafunc.fixturenames:
            metafunc.parametrize(name, cases, ids=str)


@dataclass(frozen=True)
class Body:
    """A template with posed bodies (B, V, 3), float64, and the ground they stand on."""

    template: ip.BodyTemplate
    vertices: torch.Tensor
    ground: ipt.Ground


def tiny_body(num_samples: int = 200) -> Body:
    """42 vertices, four parts that meet in pairs and threes, a sloping ground it stands in: every branch is taken."""
    mesh = trimesh.creation.icosphere(subdivisions=1)
    rest = np.asarray(mesh.vertices) * [0.4, 0.9, 0.3]
    faces = np.asarray(mesh.faces)
    centre = rest[faces].mean(axis=1)
    parts = np.where(centre[:, 1] > 0.2, (centre[:, 2] > 0.0).astype(int), 2 + (centre[:, 0] > 0.05).astype(int))
    generator = np.random.default_rng(7)
    posed = rest + [0.1, 0.72, -0.2] + generator.normal(scale=0.02, size=(3, *rest.shape))
    template = ip.BodyTemplate(rest, faces, parts, num_samples=num_samples, seed=1)
    return Body(template, torch.from_numpy(posed), ipt.Ground((0.1, 1.0, 0.05), 0.01))


@pytest.fixture(scope="session")
def lifelike_arrays():
    return model_arrays.lifelike_arrays


@pytest.fixture(scope="session")
def tiny() -> Body:
    return tiny_body()


def shared_data(name: str) -> Path:
    """A folder of measured data beside the repository; the test is skipped where it is not there."""
    root = os.environ.get("IPMAN_SHARED_DATA") or Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(root) / name
    if not folder.is_dir():
        pytest.skip(f"{name} is not at {root}: set IPMAN_SHARED_DATA")
    return folder


@pytest.fixture(scope="session")
def people() -> Body:
    """Two real people in the camera frame, y down, cut into ten slabs of equal height for want of parts."""
    folder = shared_data("mhr_bodies")
    faces = np.asarray(trimesh.load(folder / "mhr_face_mask.ply", process=False).faces)
    bodies = np.stack([np.load(folder / f"img_subj0{index}.npz")["pred_vertices"] for index in range(2)])
    up = -bodies[0, :, 1][faces].mean(axis=1)
    parts = np.minimum((10 * (up - up.min()) / np.ptp(up)).astype(int), 9)
    template = ip.BodyTemplate(bodies[0], faces, parts)
    vertices = torch.from_numpy(bodies.astype(np.float64))
    # The lowest point of each body stands 2 cm deep: pressure above and below its kink.
    lowest = (-vertices[..., 1]).amin(dim=-1)
    return Body(template, vertices, ipt.Ground((0.0, -1.0, 0.0), lowest + 0.02))


@pytest.fixture(scope="session")
def poses() -> Body:
    """64 random poses and shapes of the embedded body, turned anywhere, from 5 cm in the ground to 5 cm above it."""
    model = ip.load_body("anny")
    generator = np.random.default_rng(11)
    pose = generator.normal(scale=0.3, size=(64, 24, 3))
    pose[:, 0] = generator.normal(scale=1.5, size=(64, 3))
    vertices = torch.from_numpy(model(pose, betas=generator.normal(size=(64, 10))).vertices)
    vertices[..., 1] -= vertices[..., 1].amin(dim=-1, keepdim=True) + torch.linspace(-0.05, 0.05, 64)[:, None]
    # Coordinates that float32 has too, so that a comparison sees the rounding of the computation, not of its input.
    return Body(model.template, vertices.float().double(), ipt.Ground.y_up())
