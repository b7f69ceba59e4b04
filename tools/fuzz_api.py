"""Odd arguments against the public functions on arrays and on tensors.

    python tools/fuzz_api.py --seconds 30 --seed 1            # about half a minute
    python tools/fuzz_api.py --seconds 0 --calls 200000       # by hand
    python tools/fuzz_api.py --seed 1 --case 4711             # that one again, with its traceback

What must not happen: a crash, more than 5 s of CPU time, an exception other than ValueError, TypeError, MemoryError, or
NotImplementedError from a second derivative; a warning of numpy's; and,
where a body of a batch has a broken vertex: another
bit in any of its neighbours, a number that is not NaN for itself, or a gradient that is not zero. A sound batch under
accepted options has sound gradients.
"""

from __future__ import annotations

import functools
import os
import random
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from fuzz_harness import Wrong, run

import ipman_rs as ip
import ipman_rs.torch as ipt

torch.set_num_threads(1)

BIG = 10**400
SCALARS: tuple[Any, ...] = (
    0, 0.0, -0.0, 1, 10.0, 0.1, 1e-3, 1e-13, 1e-300, 5e-324, 1e6, 1e12, 1e13, 1e38, 1e300, 1e308, -1.0, -1e308, BIG,
    -BIG,
    10**5000, 2**63, float("nan"), float("inf"), -float("inf"), True, None, "10", b"1", 1j, [1.0], (0.1,), {},
    np.float32(0.1), np.float16(2), np.int64(3), np.uint64(2**63), np.bool_(True), np.timedelta64(1),
    np.timedelta64("NaT"),
    np.datetime64("2020-01-01"), np.longdouble("1e400"), np.array(0.1), np.array([0.1, 0.2]), np.str_("x"), object(),
)  # fmt: skip
WORDS: tuple[Any, ...] = (
    "pcom", "exact", "vertex_mean", "sample_mean", "face_area", "paper", "released", "hull", "lp", "samples",
    "vertices",
    "tanh_squared", "tanh_of_square", "log", "saturate", "none", "mean", "sum", "", "PCOM", None, 1, b"pcom", ["pcom"],
    np.array(["pcom", "exact"]), "paper-r", "balanced",
)  # fmt: skip
# The options of each function, by whether they are numbers or words.
OPTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "stability_loss": (("alpha", "gamma", "epsilon"), ("method",)),
    "ground_loss": (("alpha1", "alpha2", "beta1", "beta2"), ("points", "curve")),
    "balance_cost": (("alpha", "gamma", "sigma"), ("wrap", "method")),
    "pressure": (("alpha", "gamma"), ()),
    "center_of_pressure": (("alpha", "gamma", "epsilon"), ()),
    "support_margin": (("threshold",), ("method", "contact")),
    "base_of_support": (("threshold",), ("method", "contact")),
    "bose": (("threshold",), ("method", "com_method", "contact")),
    "body_status": (("threshold",), ("contact",)),
    "analyze": (("density",), ("preset",)),
}
GROUNDLESS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "sample_surface": ((), ()),
    "part_volumes": ((), ()),
    "center_of_mass": ((), ("method",)),
    "mass_properties": (("density",), ()),
    "self_contact_loss": (("push_width", "pull_width", "pull_weight", "near", "geodesic"), ()),
}
NUMPY_ONLY = {"binary_center_of_pressure": (("threshold",), ()), "self_penetration": (("geodesic",), ()),
              "self_contact_distance": (("near", "geodesic"), ())}  # fmt: skip


@functools.cache
def templates() -> list[ip.BodyTemplate]:
    """Tetrahedra, boxes and tubes; open, of several parts, of several components, flat, inside out,
    with loose vertices."""
    corners = np.array([[x, y, z] for x in (0, 0.4) for y in (0, 1.7) for z in (0, 0.3)])
    box = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
                    [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip
    two = np.concatenate([corners, corners + [1, 0, 0]]), np.concatenate([box, box + 8])
    made: list[tuple[Any, ...]] = [
        (corners, box), (corners, box[:-1]), (corners, box[:, ::-1]), (corners, box, np.arange(12)),
        (corners, box, np.arange(12) // 6), (*two, np.arange(24) // 12), two, (corners * [1, 1e-9, 1], box),
        (np.concatenate([corners, [[9, 9, 9]]]), box), (corners * 1e-3, box), (corners * 1e6, box),
    ]  # fmt: skip
    found = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for each in made:
            try:
                found.append(ip.BodyTemplate(*each, num_samples=60))
            except ValueError:
                continue
    return found


def bodies(draw: random.Random, template: ip.BodyTemplate, batch: int) -> np.ndarray:
    rng = np.random.default_rng(draw.getrandbits(32))
    kind = draw.choice(("float32", "float64"))
    found = template.vertices + rng.normal(0, 0.02, (batch, template.num_vertices, 3))
    return (found + rng.normal(0, 0.05, (batch, 1, 3))).astype(kind)


def odd_array(draw: random.Random, array: np.ndarray) -> Any:
    """The bodies in another shape, type, layout or place; or something that is no array."""
    changes: tuple[Callable[[], Any], ...] = (
        lambda: array[0], lambda: array[:0], lambda: array[None], lambda: np.asfortranarray(array), lambda: array[:,
        ::-1],
        lambda: array[..., ::-1], lambda: array.swapaxes(-1, -2), lambda: array[..., :2], lambda: array[:, :-1],
        lambda: array.astype(np.float16), lambda: array.astype(np.longdouble), lambda: array.astype(">f8"),
        lambda: array.astype(np.int32), lambda: array.astype(complex), lambda: array.astype(bool),
        lambda: array.astype(object),
        lambda: array.astype(str), lambda: array.astype("timedelta64[s]"), lambda: array.tolist(), lambda: array[0, 0,
        0],
        lambda: None, lambda: "vertices", lambda: np.ma.masked_array(array, array > 0),
        lambda: array * np.float32(1e30),
        lambda: array.astype(float) * 1e308, lambda: array * np.nan, lambda: array * 0,
        lambda: array.astype(float) * 1e-320,
        lambda: np.broadcast_to(array[:1], array.shape), lambda: array.view(np.recarray), lambda: [array, None],
        lambda: array.astype(float) + 1e308, lambda: np.where(array > 0, 1e308, -1e308),
        lambda: array.astype(np.longdouble) * 1e400,
        lambda: memoryview(array.tobytes()), lambda: array.reshape(-1), lambda: {"vertices": array},
    )  # fmt: skip
    with np.errstate(all="ignore"):
        return draw.choice(changes)()


def a_ground(draw: random.Random, batch: int, kind: Any) -> Any:
    normals: tuple[Any, ...] = (
        (0, 1, 0), (0, 0, 1.0), (1, 2, 3), (0, 1e-300, 0), (1e300, 0, 0), np.ones((batch, 3)), np.ones((2, batch, 3)),
        (0, 0, 0),
        (np.nan, 0, 1), (0, 1), "up", None, BIG, (BIG, 0, 0), np.ones((batch, 3), np.float16), [[0, 1, 0]] * batch,
    )  # fmt: skip
    heights: tuple[Any, ...] = (
        0.0,
        0.3,
        -1e9,
        1e308,
        np.zeros(batch),
        np.zeros((batch, 1)),
        np.nan,
        None,
        BIG,
        "0",
        np.zeros(3),
    )
    if draw.random() < 0.6:
        return kind.y_up(draw.choice((0.0, 0.05, -0.05)))
    if draw.random() < 0.1:
        return draw.choice((None, 1.0, (0, 1, 0)))
    return kind(draw.choice(normals), draw.choice(heights))


def options(draw: random.Random, names: tuple[tuple[str, ...], tuple[str, ...]], oddness: float) -> dict[str, Any]:
    numbers, words = names
    found = {name: draw.choice(SCALARS) for name in numbers if draw.random() < oddness}
    return found | {name: draw.choice(WORDS) for name in words if draw.random() < oddness}


def figures(found: Any) -> list[np.ndarray]:
    """The numbers of a result, an array a figure."""
    if isinstance(found, torch.Tensor):
        return [found.detach().double().numpy() if found.dtype.is_floating_point else found.numpy()]
    if isinstance(found, (np.ndarray, np.generic)):
        return [np.asarray(found)]
    if isinstance(found, tuple):
        return [array for each in found for array in figures(each)]
    if hasattr(found, "__dataclass_fields__"):
        skipped = ("polygon", "base_of_support", "parts", "status", "part_names", "preset", "com_method")
        return [array for name, value in vars(found).items() if name not in skipped for array in figures(value)]
    return []


def case(seed: int, number: int) -> str:
    """One call, or a batch with a broken body."""
    draw = random.Random(f"{seed} {number}")
    on_tensors = draw.random() < 0.45
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", RuntimeWarning)
        try:
            if draw.random() < 0.35:
                return _isolated(draw, on_tensors)
            return (_odd_tensors if on_tensors else _odd_arrays)(draw)
        except (ValueError, TypeError) as error:
            if isinstance(error, UnicodeError) or type(error) not in (ValueError, TypeError):
                raise
            return "refused"


def _function(draw: random.Random, numpy: bool) -> tuple[str, tuple[tuple[str, ...], tuple[str, ...]], bool]:
    table = {**OPTIONS, **GROUNDLESS, **(NUMPY_ONLY if numpy else {})}
    name = draw.choice(list(table))
    return name, table[name], name in OPTIONS or name == "binary_center_of_pressure"


def _odd_arrays(draw: random.Random) -> str:
    name, names, grounded = _function(draw, numpy=True)
    if draw.random() < 0.1:
        return _odd_template(draw)
    template, batch = draw.choice(templates()), draw.choice((0, 1, 2, 5, 17))
    vertices: Any = bodies(draw, template, batch)
    if draw.random() < 0.6 and batch:
        vertices = odd_array(draw, vertices)
    place = [a_ground(draw, batch, ip.Ground)] if grounded else []
    shape: Any = template if draw.random() < 0.97 else draw.choice((None, "body", vertices))
    getattr(ip, name)(vertices, shape, *place, **options(draw, names, 0.35))
    return "accepted"


def _odd_template(draw: random.Random) -> str:
    template = draw.choice(templates())
    vertices, faces, parts = (np.array(each) for each in (template.vertices, template.faces, template.face_parts))
    given: dict[str, Any] = {"vertices": vertices, "faces": faces, "face_parts": parts, "num_samples": 50}
    changes: tuple[Any, ...] = (
        None, "x", [], np.zeros((0, 3)), faces + 100, -faces, faces.astype(float), faces.astype(np.uint64) + 2**63,
        faces[:, :2],
        np.full_like(vertices, np.nan), np.full_like(vertices, 1e308), vertices * 0, parts[:-1], parts - 1, parts + 7,
        BIG, -1, 0,
        2**70, 1.5,
        True, np.timedelta64(3), [[0, 1, 2]], faces[[0, 0, 1]], faces[:1], np.zeros((4, 3), int), ["a"], {"a": 1},
    )  # fmt: skip
    for name in draw.sample(list(given), draw.choice((1, 1, 2))):
        given[name] = draw.choice(changes)
    if draw.random() < 0.2:
        given["seed"] = draw.choice(SCALARS)
    if draw.random() < 0.2:
        given["part_names"] = draw.choice(changes)
    ip.BodyTemplate(**given)
    return "accepted"


def _odd_tensor(draw: random.Random, array: np.ndarray) -> Any:
    tensor = torch.from_numpy(array)
    changes: tuple[Callable[[], Any], ...] = (
        lambda: tensor.to_sparse(), lambda: tensor.reshape(len(tensor), -1).to_sparse_csr(), lambda: tensor.to("meta"),
        lambda: torch.nested.nested_tensor([tensor[0], tensor[0]]), lambda: tensor.half(), lambda: tensor.bfloat16(),
        lambda: torch.quantize_per_tensor(tensor.float(), 0.1, 0, torch.qint8), lambda: tensor.to(torch.float8_e4m3fn),
        lambda: tensor.long(), lambda: tensor.bool(), lambda: tensor.to(torch.complex64), lambda: None, lambda: 1.0,
        lambda: array, lambda: array.tolist(), lambda: tensor[0], lambda: tensor[:0], lambda: tensor.transpose(-1, -2),
        lambda: tensor.flip(1), lambda: tensor[..., :2], lambda: tensor.expand(2, *tensor.shape),
        lambda: tensor * float("nan"),
        lambda: tensor.double() * 1e308, lambda: tensor.mT.contiguous().mT,
        lambda: tensor.to_mkldnn() if tensor.dtype == torch.float32 else None,
        lambda: torch.nn.Parameter(tensor), lambda: tensor.conj(),
        lambda: tensor.to(torch.complex64).conj().imag, lambda: tensor[0,
        0, 0], lambda: "x",
    )  # fmt: skip
    return draw.choice(changes)()


def _odd_tensors(draw: random.Random) -> str:
    template, batch = draw.choice(templates()), draw.choice((1, 2, 5))
    vertices: Any = torch.from_numpy(bodies(draw, template, batch))
    odd = draw.random() < 0.6
    if odd:
        vertices = _odd_tensor(draw, vertices.numpy())
    elif draw.random() < 0.7:
        vertices.requires_grad_()
    ground = a_ground(draw, batch, draw.choice((ip.Ground, ipt.Ground)))
    name = "IntuitivePhysicsLoss"
    if draw.random() < 0.3:
        found = _physics(draw, vertices, template, ground, batch)
    else:
        name, names, grounded = _function(draw, numpy=False)
        place = [ground] if grounded else []
        shape: Any = template if draw.random() < 0.97 else None
        found = getattr(ipt, name)(vertices, shape, *place, **options(draw, names, 0.3))
    if odd or not vertices.requires_grad:
        return "accepted"
    tensors = [each for each in (found if isinstance(found, tuple) else (found,)) if isinstance(each, torch.Tensor)]
    wanted = [each.sum() for each in tensors if each.requires_grad and each.isfinite().all()]
    if not wanted:
        return "accepted"
    gradient = torch.autograd.grad(sum(wanted), vertices)[0]  # type: ignore[arg-type]
    if not gradient.isfinite().all():
        raise Wrong(f"{name}: a gradient that is not finite, of finite values of finite bodies")
    return "gradient"


def _physics(draw: random.Random, vertices: Any, template: Any, ground: Any, batch: int) -> Any:
    terms = ("stability", "pull", "push", "balance", "x", 1)
    given: dict[str, Any] = {}
    if draw.random() < 0.5:
        given["weights"] = {draw.choice(terms): draw.choice(SCALARS)} if draw.random() < 0.9 else draw.choice(SCALARS)
    for name in ("preset", "reduction", "points", "curve", "method", "wrap"):
        if draw.random() < 0.15:
            given[name] = draw.choice(WORDS)
    loss = ipt.IntuitivePhysicsLoss(template, **given)
    yes = torch.ones(batch, dtype=torch.bool)
    longer = torch.ones(batch + 1, dtype=torch.bool)
    masks: tuple[Any, ...] = (None, yes, ~yes, torch.ones(batch), longer, [True], True, yes.to_sparse())
    mask = draw.choice(masks) if draw.random() < 0.4 else None
    if draw.random() < 0.5:
        return loss.weighted(vertices, ground, mask)[0]
    return tuple(loss(vertices, ground, mask).values())


def _isolated(draw: random.Random, on_tensors: bool) -> str:
    """A batch without and with a broken body."""
    template, batch = draw.choice(templates()[:7]), draw.choice((2, 3, 8, 19))
    sound = bodies(draw, template, batch)
    row = draw.randrange(batch)
    broken = sound.copy()
    broken[row, draw.randrange(template.num_vertices), draw.randrange(3)] = draw.choice((np.nan, np.inf, -np.inf))
    name, names, grounded = _function(draw, numpy=not on_tensors)
    given = {k: v for k, v in options(draw, names, 0.15).items() if isinstance(v, (int, float, str)) and k != "preset"}
    place = [ip.Ground.y_up(draw.choice((0.0, 0.1)))] if grounded else []
    both = []
    for vertices in (sound, broken):
        array: Any = torch.from_numpy(vertices).requires_grad_() if on_tensors else vertices
        found = getattr(ipt if on_tensors else ip, name)(array, template, *place, **given)
        values = figures(found)
        tensors = [
            each
            for each in (found if isinstance(found, tuple) else (found,))
            if on_tensors and isinstance(each, torch.Tensor)
        ]
        wanted = [each[torch.isfinite(each)].sum() for each in tensors if each.requires_grad]
        if wanted:
            values.append(torch.autograd.grad(sum(wanted), array)[0].numpy())  # type: ignore[arg-type]
            if vertices is broken and values[-1][row].any():
                raise Wrong(f"{name} {given}: the broken body has a gradient")
        both.append(values)
    others = np.arange(batch) != row
    for one, other in zip(*both, strict=True):
        if one[others].tobytes() != other[others].tobytes():
            raise Wrong(f"{name} {given}: a broken body changed its neighbours")
    first = both[1][0]
    if first.dtype.kind == "f" and name not in ("body_status",) and not np.isnan(first[row]).all():
        raise Wrong(f"{name} {given}: a broken body has a number")
    return "isolated"


if __name__ == "__main__":
    templates()
    run(case, (__doc__ or "").splitlines()[0])
