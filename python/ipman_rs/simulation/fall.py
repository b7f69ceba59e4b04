"""The drop test: rigid bodies are placed on their ground and simulated under gravity.

A rigid body touches a plane only with its convex hull. Mass, centre of mass and inertia are the exact ones of the
mesh, never those of the hull. `shape="vhacd"` is the paper's mode, which decomposes the body into convex hulls first;
that moves its soles by up to a voxel, so it is put on the lowest point of these hulls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs import _core
from ipman_rs.arrays import Bodies, of_each
from ipman_rs.checks import choice, not_negative, number, positive, whole
from ipman_rs.ground import Ground
from ipman_rs.quantities import densities
from ipman_rs.status import Status
from ipman_rs.template import BodyTemplate

from .cross_check import each_drop
from .drop import Drop
from .solids import CONTACT, Solids
from .tipping import FALLEN

Engine = Literal["rapier", "bullet", "mujoco"]
Shape = Literal["hull", "vhacd"]
ENGINES: tuple[str, ...] = get_args(Engine)
HUNDRED_STEPS = 100 / 240  # s, the paper's 100 steps in the usual length
VERDICT = 2.0  # s; after 100 steps a body that falls has moved by centimetres, but need not have tilted by 15° yet
TIMES = (HUNDRED_STEPS, VERDICT)
STEP = 1 / 240  # s
PIECE = 32  # bodies between two looks at the progress
MOST_STEPS = 1_000_000


@dataclass(frozen=True, eq=False)
class Simulation:
    """What became of stiff bodies; float64, shapes start with the batch's, T times.

    NaN for bodies that were not simulated: `status` (bits of `ipman_rs.Status`) says why.

    engine: its name.
    times: (T,) seconds after they were let go, in whole steps.
    center_of_mass: (..., 3) m in the pose. start: (..., 3) m where it was let go.
    center: (..., T, 3) m, of mass. rotation: (..., T, 3, 3), how the body has turned since its pose.
    displacement: (..., T) m, of the centre of mass since it was let go.
    tilt: (..., T) rad, of the body's up axis; turning about it is none.
    """

    engine: str
    times: NDArray[np.float64]
    status: NDArray[np.int64]
    center_of_mass: NDArray[np.float64]
    start: NDArray[np.float64]
    center: NDArray[np.float64]
    rotation: NDArray[np.float64]
    displacement: NDArray[np.float64]
    tilt: NDArray[np.float64]

    @property
    def has_verdict(self) -> bool:
        """Whether the last time is late enough, 2 s, to say which bodies stand. Before, there is displacement alone."""
        return bool(self.times[-1] >= VERDICT - 1e-9)

    def fell(self, tilt: float = FALLEN) -> Any:
        """(...,) whether the up axis has tilted by more than this, in radians, at the last time. False where unknown.

        Raises:
            ValueError: the last time is earlier than 2 s, when a body that will fall may hardly have tilted yet.
        """
        if not self.has_verdict:
            raise ValueError(
                f"times: whether a body fell is judged at {VERDICT:g} s or later, got {self.times[-1]:.3g} s as the "
                "last; until then displacement says how far it has moved"
            )
        return self.tilt[..., -1] > tilt

    def posed(self, vertices: ArrayLike) -> NDArray[Any]:
        """(..., T, V, 3) the simulated `vertices` (..., V, 3), where they are at each time."""
        local = np.asarray(vertices, np.float64) - self.center_of_mass[..., None, :]
        return np.einsum("...tij,...vj->...tvi", self.rotation, local) + self.center[..., None, :]


def simulate(
    vertices: ArrayLike,
    template: BodyTemplate,
    ground: Ground,
    times: Sequence[float] = TIMES,
    engine: Engine = "rapier",
    shape: Shape = "hull",
    step: float = STEP,
    friction: float = 1.0,
    density: ArrayLike = 985.0,
    snap: bool = True,
    contact: float = CONTACT,
    resolution: int = 64,
    progress: Callable[[int], None] = lambda done: None,
) -> Simulation:
    """Let stiff bodies go on their ground and look where they are after `times`. vertices (..., V, 3) m.

    Args:
        times: seconds, ascending; rounded to whole steps. 100 steps of another length are another test.
        engine: rapier is built in; bullet and mujoco need `pip install 'ipman_rs[bullet]'` or `'ipman_rs[mujoco]'`.
        shape: what touches, the convex hull or the paper's V-HACD.
        step: s.
        friction: Coulomb's, of body and ground. Nothing bounces.
        density: kg/m³, one for all parts or (P,).
        snap: put the lowest point of the shape on the ground first. Otherwise a body starts where it is: one above the
            ground falls onto it, one in the ground is driven out.
        contact: with `snap`, a body whose lowest vertex is higher than this above the ground is in the air: not
            simulated, status NO_CONTACT. m.
        resolution: of V-HACD, voxels along the longest side.
        progress: called with the number of bodies that are done.

    Raises:
        ValueError, TypeError: an argument of a wrong shape, kind or range.
        ImportError: the engine is not installed.
    """
    bodies = Bodies(vertices, template)
    options = checked_options(engine, shape, times, step, friction, snap, contact, resolution)
    options = replace(options, densities=densities(density, template))
    placed, normal, height = bodies.over(ground)
    status, places = [], []
    for first in range(0, len(placed), PIECE):
        piece = (placed[first : first + PIECE], normal[first : first + PIECE], height[first : first + PIECE])
        run = _rapier if engine == "rapier" else _cross_check
        own_status, own_places = run(engine, template, options, *piece)
        status.append(own_status)
        places.append(own_places)
        progress(min(first + PIECE, len(placed)))
    return _simulation(engine, bodies, ground, options, status, places)


@dataclass(frozen=True)
class _Options:
    shape: str
    resolution: int
    contact: float
    snap: bool
    step: float
    friction: float
    looks: list[int]
    densities: list[float] = field(default_factory=list)


def checked_options(
    engine: Engine,
    shape: Shape,
    times: Sequence[float],
    step: float,
    friction: float,
    snap: bool,
    contact: float = CONTACT,
    resolution: int = 64,
) -> _Options:
    """The options of `simulate` that need no body. ValueError or TypeError, naming the argument."""
    choice("engine", engine, Engine)
    return _Options(
        shape=choice("shape", shape, Shape),
        resolution=whole("resolution", resolution, 2, 1024),
        contact=positive("contact", contact),
        snap=bool(snap),
        step=positive("step", step, "seconds"),
        friction=not_negative("friction", friction),
        looks=_looks(times, step),
    )


def _looks(times: Sequence[float], step: float) -> list[int]:
    """The steps after which to look."""
    looks = [round(not_negative("times", number("times", time)) / step) for time in times]
    if not looks:
        raise ValueError("times: expected at least one time in seconds")
    if sorted(looks) != looks:
        raise ValueError(f"times: expected ascending seconds, got {list(times)}")
    if looks[-1] > MOST_STEPS:
        raise ValueError(f"times: {times[-1]:g} s are {looks[-1]:,} steps of {step:g} s; at most {MOST_STEPS:,}")
    return looks


def _rapier(
    engine: str, template: BodyTemplate, options: _Options, vertices: Any, normal: Any, height: Any
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    return _core.simulate(
        template._core, options.shape, options.resolution, options.densities, options.contact, options.snap,
        options.step, options.friction, options.looks, vertices, normal, height,
    )  # fmt: skip


def _cross_check(
    engine: str, template: BodyTemplate, options: _Options, vertices: Any, normal: Any, height: Any
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The same by another engine, one body after the other."""
    solids = Solids.of_rows(
        _core.solids(template._core, options.densities, options.contact, vertices, normal, height)
    )  # fmt: skip
    touching = of_each(*_core.touching(template._core, options.shape, options.resolution, vertices, normal, height))
    starts = solids.is_solid & ~(options.snap & ((solids.status & Status.NO_CONTACT) != 0))
    status = solids.status | np.where(starts & [len(points) == 0 for points in touching], Status.NOT_SIMULATED, 0)
    places = np.full((len(status), 1 + len(options.looks), 12), np.nan)
    drops = {
        body: Drop(
            points=touching[body] - solids.center[body],
            mass=float(solids.mass[body]),
            inertia=solids.inertia[body],
            center=solids.center[body],
            normal=normal[body],
            height=float(height[body]),
            snap=options.snap,
        )
        for body in np.flatnonzero(starts & (status & Status.NOT_SIMULATED == 0)).tolist()
    }
    for body, placements in each_drop(engine, drops, options.looks, options.step, options.friction):
        if np.isfinite(placements).all():
            places[body] = placements
        else:
            status[body] |= Status.NOT_SIMULATED
    return status, places


def _simulation(
    engine: str,
    bodies: Bodies,
    ground: Ground,
    options: _Options,
    status: list[NDArray[np.int64]],
    places: list[NDArray[np.float64]],
) -> Simulation:
    count = len(options.looks)
    rows = np.concatenate(places) if places else np.zeros((0, 1 + count, 12))
    start, center = rows[:, 0, :3], rows[:, 1:, :3]
    rotation = rows[:, 1:, 3:].reshape(-1, count, 3, 3)
    _, normal, height = bodies.over(ground)
    turned_up = np.einsum("btij,bj->bti", rotation, normal)
    sine = np.linalg.norm(np.cross(turned_up, normal[:, None]), axis=-1)
    cosine = (turned_up * normal[:, None]).sum(axis=-1)
    solids = Solids.of_rows(
        _core.solids(bodies.template._core, options.densities, options.contact, bodies.vertices, normal, height)
    )
    return Simulation(
        engine=engine,
        times=np.array(options.looks) * options.step,
        status=bodies.unfold(np.concatenate([*status, np.zeros(0, np.int64)])),
        center_of_mass=bodies.unfold(solids.center, 3),
        start=bodies.unfold(start.copy(), 3),
        center=bodies.unfold(center.copy(), count, 3),
        rotation=bodies.unfold(rotation.copy(), count, 3, 3),
        displacement=bodies.unfold(np.linalg.norm(center - start[:, None], axis=-1), count),
        tilt=bodies.unfold(np.arctan2(sine, cosine), count),
    )
