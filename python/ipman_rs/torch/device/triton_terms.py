"""`stability_terms` as Triton kernels: one program a (body, block), every sum in a fixed order, no atomics.

    centres -> triangles, samples -> balance        values, and what the gradient is made of
    slopes, rims -> vertices                        gradient

`triangles` and `samples` leave one partial sum a block, all of whose entries lie in one part; `balance` adds them in
float64 and solves the body's few numbers; `slopes` writes two numbers a sample, and each vertex collects what its own
samples and triangles hold for it. The kernels (`triton_kernels`) are imported at the first launch: importing this file
needs no Triton.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from ipman_rs.template import by_key

from .stability_terms import NUMBERS
from .tables import Matrices, PerTemplate, matrices

if TYPE_CHECKING:
    from ipman_rs import BodyTemplate

BLOCK = 256
INSTALLED = find_spec("triton") is not None


def serves(vertices: Tensor) -> bool:
    """Whether the kernels run on this tensor's device: CUDA, or anything under Triton's interpreter."""
    return INSTALLED and (vertices.is_cuda or os.environ.get("TRITON_INTERPRET") == "1")


@dataclass(frozen=True, eq=False)
class Layout:
    """Index arrays of the kernels, int32. Triangles and samples stand in blocks of one part each, −1 where unused.

    triangles (NT · BLOCK, 3), triangle_part (NT · BLOCK,); block_part (NT,)
    samples (NS · BLOCK, 3), barycentric (NS · BLOCK, 3); sample_part (NS,); part_sizes (P,) samples of each part
    rim_starts (C + 1,), rims: vertices of each virtual vertex's boundary
    lid_starts (C + 1,), lids: triangles at each virtual vertex
    around_starts (V + 1,), around: triangles at each vertex
    on_starts (V + 1,), on, on_weight: samples at each vertex and its weight in them
    centre_of (V,): the virtual vertex that a vertex bears on, −1 if none; centre_share (V,): how much of it
    """

    origin: int
    num_vertices: int
    num_samples: int
    triangles: Tensor
    triangle_part: Tensor
    block_part: Tensor
    samples: Tensor
    barycentric: Tensor
    sample_part: Tensor
    part_sizes: Tensor
    rim_starts: Tensor
    rims: Tensor
    lid_starts: Tensor
    lids: Tensor
    around_starts: Tensor
    around: Tensor
    on_starts: Tensor
    on: Tensor
    on_weight: Tensor
    centre_of: Tensor
    centre_share: Tensor


def _in_blocks(parts: np.ndarray, num_parts: int) -> tuple[np.ndarray, np.ndarray]:
    """The slot of each entry when parts are laid out one after the other in whole blocks, and each block's part."""
    counts = np.bincount(parts, minlength=num_parts)
    blocks = -(-counts // BLOCK)
    order = np.argsort(parts, kind="stable")
    start = (np.cumsum(blocks) - blocks) * BLOCK
    slot = np.empty(len(parts), np.int64)
    slot[order] = np.arange(len(parts)) + np.repeat(start - (np.cumsum(counts) - counts), counts)
    return slot, np.repeat(np.arange(num_parts), blocks)


def _build(template: BodyTemplate, device: torch.device, dtype: torch.dtype) -> Layout:
    maps: Matrices = matrices(template)
    num_vertices, num_parts = template.num_vertices, template.num_parts

    def whole(array: Any) -> Tensor:
        return torch.tensor(np.ascontiguousarray(array), device=device, dtype=torch.int32)

    def real(array: Any) -> Tensor:
        return torch.tensor(np.ascontiguousarray(array), device=device, dtype=dtype)

    triangle_slot, block_part = _in_blocks(maps.triangle_parts, num_parts)
    triangles = np.full((len(block_part) * BLOCK, 3), -1)
    triangles[triangle_slot] = maps.triangles

    sample_slot, sample_part = _in_blocks(template.sample_parts, num_parts)
    samples = np.full((len(sample_part) * BLOCK, 3), -1)
    barycentric = np.zeros(samples.shape)
    samples[sample_slot] = template.faces[template.sample_faces]
    barycentric[sample_slot] = template.sample_barycentric

    incidence = maps.incidence
    at_vertices, at_centres = incidence[:num_vertices].tocsr(), incidence[num_vertices:].tocsr()
    transposed = maps.samples.T.tocsr()
    bears = maps.centres.tocoo()
    centre_of, centre_share = np.full(num_vertices, -1), np.zeros(num_vertices)
    centre_of[bears.col], centre_share[bears.col] = bears.row, bears.data
    return Layout(
        origin=maps.origin,
        num_vertices=num_vertices,
        num_samples=template.num_samples,
        triangles=whole(triangles),
        triangle_part=whole(np.repeat(block_part, BLOCK)),
        block_part=whole(block_part),
        samples=whole(samples),
        barycentric=real(barycentric),
        sample_part=whole(sample_part),
        part_sizes=whole(np.bincount(template.sample_parts, minlength=num_parts)),
        rim_starts=whole(maps.centres.indptr),
        rims=whole(maps.centres.indices),
        lid_starts=whole(at_centres.indptr),
        lids=whole(triangle_slot[at_centres.indices]),
        around_starts=whole(at_vertices.indptr),
        around=whole(triangle_slot[at_vertices.indices]),
        on_starts=whole(transposed.indptr),
        on=whole(sample_slot[transposed.indices]),
        on_weight=real(transposed.data),
        centre_of=whole(centre_of),
        centre_share=real(centre_share),
    )


_layout = PerTemplate(_build)

# What one block of samples leaves: lowest height, Σ ρ, Σ ρ x, Σ x, Σ pull, Σ push.
SAMPLE_SUMS = 10
# What `balance` leaves of a body before the numbers of its parts: shift, d m̄ (3), 1 / (Σ ρ + ε), d m̄ · s̄, and the
# factors of the pull and the push slope.
BODY_NUMBERS = 8


def _run(
    vertices: Tensor,
    normal: Tensor,
    height: Tensor,
    weights: Tensor | None,
    template_key: int,
    curve: str,
    options: list[float],
) -> tuple[Tensor, Tensor]:
    """Values (B, 3) and, given weights, the gradient of their weighted sum (B, V, 3)."""
    with torch.cuda.device_of(vertices):  # Triton launches on the current device
        return _launch(vertices, normal, height, weights, template_key, curve, options)


def _launch(
    vertices: Tensor,
    normal: Tensor,
    height: Tensor,
    weights: Tensor | None,
    template_key: int,
    curve: str,
    options: list[float],
) -> tuple[Tensor, Tensor]:
    k: Any = import_module(f"{__package__}.triton_kernels")
    template = by_key(template_key)
    layout: Layout = _layout(template, vertices.device, vertices.dtype)
    vertices = vertices.contiguous()
    normal, height = normal.to(torch.float64).contiguous(), height.to(torch.float64).contiguous()
    batch, parts = len(vertices), template.num_parts
    gradient = torch.empty_like(vertices if weights is not None else vertices[:0])
    values = vertices.new_empty(batch, len(NUMBERS))
    if batch == 0:
        return values, gradient
    finite = vertices.isfinite().flatten(1).all(dim=1)
    d_out = vertices.new_empty(batch, len(NUMBERS)) if weights is None else weights.contiguous()

    triangle_blocks, sample_blocks = len(layout.block_part), len(layout.sample_part)
    centre_count = len(layout.rim_starts) - 1
    centres = vertices.new_empty(batch, max(centre_count, 1), 3)
    area = vertices.new_empty(batch, triangle_blocks * BLOCK, 3)
    volumes = vertices.new_empty(batch, triangle_blocks)
    sums = vertices.new_empty(batch, sample_blocks, SAMPLE_SUMS)
    solved = vertices.new_empty(batch, BODY_NUMBERS + 2 * parts, dtype=torch.float64)
    origin = {"ORIGIN": layout.origin, "V": layout.num_vertices}
    curves = {"ALPHA": options[0], "GAMMA": options[1], "SHIFTED": options[2] == 0, "SQUARED": curve == "tanh_squared"}
    ground = {"ALPHA1": options[3], "ALPHA2": options[4], "BETA1": options[5], "BETA2": options[6]}

    if centre_count:
        k.centres[batch, centre_count](vertices, layout.rim_starts, layout.rims, centres, **origin, BLOCK=BLOCK)
    k.triangles[batch, triangle_blocks](
        vertices, centres, layout.triangles, area, volumes, C=max(centre_count, 1), **origin, BLOCK=BLOCK
    )
    k.samples[batch, sample_blocks](
        vertices, normal, height, layout.samples, layout.barycentric, sums,
        SUMS=SAMPLE_SUMS, **origin, **curves, **ground, BLOCK=BLOCK,
    )  # fmt: skip
    k.balance[(batch,)](
        vertices, normal, finite, d_out, volumes, layout.block_part, sums, layout.sample_part, layout.part_sizes,
        values, solved, triangle_blocks, sample_blocks,
        S=layout.num_samples, P=parts, PARTS=_power_of_two(parts), GAMMA=options[1], EPSILON=options[2],
        SUMS=SAMPLE_SUMS, NUMBERS=BODY_NUMBERS, **origin, **ground, BLOCK=64,
    )  # fmt: skip
    if weights is None:
        return values, gradient

    slopes = vertices.new_empty(batch, sample_blocks * BLOCK, 2)
    k.slopes[batch, sample_blocks](
        vertices, normal, height, layout.samples, layout.barycentric, layout.sample_part, solved, slopes,
        P=parts, NUMBERS=BODY_NUMBERS, **origin, **curves, ALPHA2=options[4], BETA2=options[6], BLOCK=BLOCK,
    )  # fmt: skip
    triangle_slots = triangle_blocks * BLOCK
    about = {"T": triangle_slots, "P": parts, "NUMBERS": BODY_NUMBERS}
    if centre_count:
        k.rims[batch, centre_count](
            area, layout.triangle_part, solved, layout.lid_starts, layout.lids, centres, **about, BLOCK=BLOCK
        )
    k.vertices[batch, -(-layout.num_vertices // BLOCK)](
        normal, finite, solved, area, layout.triangle_part, layout.around_starts, layout.around,
        slopes, layout.on_starts, layout.on, layout.on_weight, centres, layout.centre_of, layout.centre_share, gradient,
        V=layout.num_vertices, C=max(centre_count, 1), S=sample_blocks * BLOCK, **about, BLOCK=BLOCK,
    )  # fmt: skip
    return values, gradient


def _power_of_two(number: int) -> int:
    """The smallest power of two that is not less."""
    return 1 << (number - 1).bit_length()


ARGUMENTS = "Tensor vertices, Tensor normal, Tensor height"
PROBLEM = "int template_key, str curve, float[] options"

_library = torch.library.Library("ipman_rs", "FRAGMENT")
_library.define(f"stability_terms({ARGUMENTS}, {PROBLEM}) -> Tensor", tags=(torch.Tag.pt2_compliant_tag,))
_library.define(
    f"stability_terms_and_gradient({ARGUMENTS}, Tensor weights, {PROBLEM}) -> (Tensor, Tensor)",
    tags=(torch.Tag.pt2_compliant_tag,),
)


def _values(vertices: Tensor, normal: Tensor, height: Tensor, *problem: Any) -> Tensor:
    return _run(vertices, normal, height, None, *problem)[0]


for _device in ("CUDA", "CPU"):  # the CPU under the interpreter
    _library.impl("stability_terms", _values, _device)
    _library.impl("stability_terms_and_gradient", _run, _device)


@torch.library.register_fake("ipman_rs::stability_terms", lib=_library)
def _(vertices: Tensor, *_: Any) -> Tensor:
    return vertices.new_empty(vertices.shape[0], len(NUMBERS))


@torch.library.register_fake("ipman_rs::stability_terms_and_gradient", lib=_library)
def _(vertices: Tensor, *_: Any) -> tuple[Tensor, Tensor]:
    return vertices.new_empty(vertices.shape[0], len(NUMBERS)), vertices.new_empty(vertices.shape)


def values(
    vertices: Tensor, normal: Tensor, height: Tensor, template_key: int, curve: str, options: tuple[float, ...]
) -> Tensor:
    """As `stability_terms.values`."""
    return torch.ops.ipman_rs.stability_terms(vertices, normal, height, template_key, curve, options)


def values_and_gradient(
    vertices: Tensor,
    normal: Tensor,
    height: Tensor,
    weights: Tensor,
    template_key: int,
    curve: str,
    options: tuple[float, ...],
) -> tuple[Tensor, Tensor]:
    """As `stability_terms.values_and_gradient`."""
    return torch.ops.ipman_rs.stability_terms_and_gradient(
        vertices, normal, height, weights, template_key, curve, options
    )
