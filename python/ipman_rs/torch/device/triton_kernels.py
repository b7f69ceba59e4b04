# pyright: basic, reportArgumentType=false, reportAttributeAccessIssue=false, reportOperatorIssue=false, reportGeneralTypeIssues=false
"""The kernels of `triton_terms`, where they are put together. Arrays are (B, …) and contiguous; axis 0 of the grid is
the body. Upper-case arguments are compile-time constants. `Layout` explains the index arrays.
"""

from __future__ import annotations

import triton
import triton.language as tl


@triton.jit
def _xyz(rows, index, mask):
    """Rows of (n, 3), 0 where masked."""
    at = rows + 3 * index
    return tl.load(at, mask=mask, other=0), tl.load(at + 1, mask=mask, other=0), tl.load(at + 2, mask=mask, other=0)


@triton.jit
def _origin(vertices, body, ORIGIN: tl.constexpr, V: tl.constexpr):
    at = vertices + (body.to(tl.int64) * V + ORIGIN) * 3
    return tl.load(at), tl.load(at + 1), tl.load(at + 2)


@triton.jit
def _tanh(x):
    """From e^{−2|x|}; near 0, where that would cancel, the first terms of the series."""
    small = x * x
    series = 1 - small * (1 / 3 - small * (2 / 15 - small * (17 / 315 - small * (62 / 2835 - small * (1382 / 155925)))))
    e = tl.exp(-2 * tl.abs(x))
    whole = (1 - e) / (1 + e)
    near = 0.25 if x.dtype == tl.float32 else 0.005
    return tl.where(small < near * near, x * series, tl.where(x < 0, -whole, whole))


@triton.jit
def _wave(x, SQUARED: tl.constexpr):
    """T(x) of Eqs. 6 and 7, and dT/dx."""
    if SQUARED:
        t = _tanh(x)
        return t * t, 2 * t * (1 - t * t)
    t = _tanh(x * x)
    return t, 2 * x * (1 - t * t)


@triton.jit
def _density(height, shift, ALPHA: tl.constexpr, GAMMA: tl.constexpr):
    """ρ (Eq. 2) of a height, the ground being raised by `shift`."""
    above = tl.exp(-GAMMA * tl.maximum(height - shift, 0))
    return tl.where(height < 0, 1 - ALPHA * height, above)


@triton.jit
def _sample(vertices, normal, height, samples, barycentric, ORIGIN: tl.constexpr, V: tl.constexpr, BLOCK: tl.constexpr):
    """This block's samples: position from the body's origin, height, and which are real.

    The steep pressure curve multiplies rounding by α: heights are small near the ground, if formed in float64.
    """
    body = tl.program_id(0)
    slot = tl.program_id(1) * BLOCK + tl.arange(0, BLOCK)
    points = vertices + body.to(tl.int64) * V * 3
    ox, oy, oz = _origin(vertices, body, ORIGIN, V)
    nx, ny, nz = _xyz(normal, body, True)
    level = tl.load(height + body)

    real = tl.load(samples + 3 * slot) >= 0
    x = tl.zeros([BLOCK], ox.dtype)
    y, z, h = x, x, x
    for corner in tl.static_range(3):
        index = tl.load(samples + 3 * slot + corner)
        weight = tl.load(barycentric + 3 * slot + corner)
        vx, vy, vz = _xyz(points, index, real)
        x += weight * (vx - ox)
        y += weight * (vy - oy)
        z += weight * (vz - oz)
        h += weight * (nx * vx + ny * vy + nz * vz - level).to(ox.dtype)
    return x, y, z, h, real, slot


@triton.jit
def centres(vertices, rim_starts, rims, out, ORIGIN: tl.constexpr, V: tl.constexpr, BLOCK: tl.constexpr):
    """The mean of a boundary's vertices, from the body's origin: grid (B, C) -> out (B, C, 3)."""
    body, centre = tl.program_id(0), tl.program_id(1)
    points = vertices + body.to(tl.int64) * V * 3
    ox, oy, oz = _origin(vertices, body, ORIGIN, V)
    start, end = tl.load(rim_starts + centre), tl.load(rim_starts + centre + 1)
    x = tl.zeros([BLOCK], ox.dtype)
    y, z = x, x
    for first in range(start, end, BLOCK):
        slot = first + tl.arange(0, BLOCK)
        real = slot < end
        vx, vy, vz = _xyz(points, tl.load(rims + slot, mask=real, other=0), real)
        x += tl.where(real, vx - ox, 0)
        y += tl.where(real, vy - oy, 0)
        z += tl.where(real, vz - oz, 0)
    to = out + (body * tl.num_programs(1) + centre) * 3
    count = (end - start).to(ox.dtype)
    tl.store(to, tl.sum(x) / count)
    tl.store(to + 1, tl.sum(y) / count)
    tl.store(to + 2, tl.sum(z) / count)


@triton.jit
def _corner(points, centres, index, ox, oy, oz, V: tl.constexpr):
    """Corners of triangles, from the body's origin; an index from V on is a virtual vertex, −1 gives 0."""
    real = (index >= 0) & (index < V)
    x, y, z = _xyz(points, index, real)
    cx, cy, cz = _xyz(centres, index - V, index >= V)
    return tl.where(real, x - ox, cx), tl.where(real, y - oy, cy), tl.where(real, z - oz, cz)


@triton.jit
def triangles(
    vertices, centres, corners, area, volumes,
    C: tl.constexpr, ORIGIN: tl.constexpr, V: tl.constexpr, BLOCK: tl.constexpr,
):  # fmt: skip
    """Area normals (B, T, 3), twice the area long, and six times the volume over each block (B, NT)."""
    body, block = tl.program_id(0), tl.program_id(1)
    slot = block * BLOCK + tl.arange(0, BLOCK)
    points, middles = vertices + body.to(tl.int64) * V * 3, centres + body * C * 3
    ox, oy, oz = _origin(vertices, body, ORIGIN, V)
    ax, ay, az = _corner(points, middles, tl.load(corners + 3 * slot), ox, oy, oz, V)
    bx, by, bz = _corner(points, middles, tl.load(corners + 3 * slot + 1), ox, oy, oz, V)
    cx, cy, cz = _corner(points, middles, tl.load(corners + 3 * slot + 2), ox, oy, oz, V)
    bx, by, bz = bx - ax, by - ay, bz - az
    cx, cy, cz = cx - ax, cy - ay, cz - az
    x, y, z = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    to = area + (body.to(tl.int64) * tl.num_programs(1) * BLOCK + slot) * 3
    tl.store(to, x)
    tl.store(to + 1, y)
    tl.store(to + 2, z)
    tl.store(volumes + body * tl.num_programs(1) + block, tl.sum(ax * x + ay * y + az * z))


@triton.jit
def samples(
    vertices, normal, height, corners, barycentric, sums,
    SUMS: tl.constexpr, ORIGIN: tl.constexpr, V: tl.constexpr,
    ALPHA: tl.constexpr, GAMMA: tl.constexpr, SHIFTED: tl.constexpr, SQUARED: tl.constexpr,
    ALPHA1: tl.constexpr, ALPHA2: tl.constexpr, BETA1: tl.constexpr, BETA2: tl.constexpr, BLOCK: tl.constexpr,
):  # fmt: skip
    """What each block of samples adds up to: (B, NS, SUMS). ρ is that of the block lowered onto the ground."""
    x, y, z, h, real, _ = _sample(vertices, normal, height, corners, barycentric, ORIGIN, V, BLOCK)
    lowest = tl.min(tl.where(real, h, float("inf")))
    density = tl.where(real, _density(h, tl.maximum(lowest, 0) if SHIFTED else 0.0, ALPHA, GAMMA), 0)
    pull, _ = _wave(tl.where(real, tl.maximum(h, 0), 0) / ALPHA2, SQUARED)
    push, _ = _wave(tl.where(real, tl.minimum(h, 0), 0) / BETA2, SQUARED)
    to = sums + (tl.program_id(0) * tl.num_programs(1) + tl.program_id(1)) * SUMS
    tl.store(to, lowest)
    tl.store(to + 1, tl.sum(density))
    tl.store(to + 2, tl.sum(density * x))
    tl.store(to + 3, tl.sum(density * y))
    tl.store(to + 4, tl.sum(density * z))
    tl.store(to + 5, tl.sum(tl.where(real, x, 0)))
    tl.store(to + 6, tl.sum(tl.where(real, y, 0)))
    tl.store(to + 7, tl.sum(tl.where(real, z, 0)))
    tl.store(to + 8, tl.sum(pull))
    tl.store(to + 9, tl.sum(push))


@triton.jit
def balance(
    vertices, normal, finite, weights, volumes, block_part, sums, sample_part, part_sizes, values, solved,
    triangle_blocks, sample_blocks,
    S: tl.constexpr, P: tl.constexpr, PARTS: tl.constexpr, GAMMA: tl.constexpr, EPSILON: tl.constexpr,
    SUMS: tl.constexpr, NUMBERS: tl.constexpr, ORIGIN: tl.constexpr, V: tl.constexpr,
    ALPHA1: tl.constexpr, ALPHA2: tl.constexpr, BETA1: tl.constexpr, BETA2: tl.constexpr, BLOCK: tl.constexpr,
):  # fmt: skip
    """Grid (B,): the values (B, 3) and the numbers `solved` that the gradient is made of, in float64."""
    body = tl.program_id(0)
    wide = tl.float64
    part = tl.arange(0, PARTS)
    volumes += body * triangle_blocks
    sums += body * sample_blocks * SUMS

    volume = tl.zeros([PARTS], wide)
    for first in range(0, triangle_blocks, BLOCK):
        block = first + tl.arange(0, BLOCK)
        real = block < triangle_blocks
        six = tl.load(volumes + block, mask=real, other=0).to(wide)
        of = tl.load(block_part + block, mask=real, other=-1)
        volume += tl.sum(tl.where(of[None, :] == part[:, None], six[None, :], 0), axis=1) / 6

    low = tl.full([BLOCK], float("inf"), wide)
    for first in range(0, sample_blocks, BLOCK):
        block = first + tl.arange(0, BLOCK)
        low = tl.minimum(low, tl.load(sums + block * SUMS, mask=block < sample_blocks, other=float("inf")).to(wide))
    shift = tl.maximum(tl.min(low), 0) if EPSILON == 0 else tl.min(low) * 0

    total = tl.zeros([BLOCK], wide)
    mx, my, mz, pull, push = total, total, total, total, total
    sx = tl.zeros([PARTS], wide)
    sy, sz = sx, sx
    for first in range(0, sample_blocks, BLOCK):
        block = first + tl.arange(0, BLOCK)
        real = block < sample_blocks
        at = sums + block * SUMS
        own = tl.maximum(tl.load(at, mask=real, other=0).to(wide), 0) if EPSILON == 0 else tl.zeros([BLOCK], wide)
        factor = tl.exp(-GAMMA * tl.where(real, own - shift, 0))
        total += factor * tl.load(at + 1, mask=real, other=0)
        mx += factor * tl.load(at + 2, mask=real, other=0)
        my += factor * tl.load(at + 3, mask=real, other=0)
        mz += factor * tl.load(at + 4, mask=real, other=0)
        of = tl.load(sample_part + block, mask=real, other=-1)[None, :] == part[:, None]
        sx += tl.sum(tl.where(of, tl.load(at + 5, mask=real, other=0).to(wide)[None, :], 0), axis=1)
        sy += tl.sum(tl.where(of, tl.load(at + 6, mask=real, other=0).to(wide)[None, :], 0), axis=1)
        sz += tl.sum(tl.where(of, tl.load(at + 7, mask=real, other=0).to(wide)[None, :], 0), axis=1)
        pull += tl.load(at + 8, mask=real, other=0)
        push += tl.load(at + 9, mask=real, other=0)

    # The centre of pressure (Eq. 3); ε pulls towards the world's origin.
    ox, oy, oz = _origin(vertices, body, ORIGIN, V)
    load = tl.sum(total) + EPSILON
    px = (tl.sum(mx) - EPSILON * ox) / load
    py = (tl.sum(my) - EPSILON * oy) / load
    pz = (tl.sum(mz) - EPSILON * oz) / load

    # The centre of mass (Eq. 1).
    count = tl.load(part_sizes + part, mask=part < P, other=0).to(wide)
    size = tl.abs(volume)
    weight = tl.sum(size * count)
    cx, cy, cz = tl.sum(size * sx) / weight, tl.sum(size * sy) / weight, tl.sum(size * sz) / weight

    # Their distance on the ground (Eq. 4).
    nx, ny, nz = _xyz(normal, body, True)
    dx, dy, dz = cx - px, cy - py, cz - pz
    along = dx * nx + dy * ny + dz * nz
    dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
    length = tl.sqrt(dx * dx + dy * dy + dz * dz)

    sound = tl.load(finite + body) != 0
    nan = float("nan")
    tl.store(values + body * 3, tl.where(sound, length, nan))
    tl.store(values + body * 3 + 1, tl.where(sound, ALPHA1 * tl.sum(pull) / S, nan))
    tl.store(values + body * 3 + 2, tl.where(sound, BETA1 * tl.sum(push) / S, nan))

    # The gradient by m̄ is the unit offset, 0 where the two points coincide, and its negative the one by s̄.
    to = solved + body * (NUMBERS + 2 * P)
    scale = tl.load(weights + body * 3).to(wide) / tl.where(length > 0, length, 1)
    dx, dy, dz = scale * dx, scale * dy, scale * dz
    tl.store(to, shift)
    tl.store(to + 1, dx)
    tl.store(to + 2, dy)
    tl.store(to + 3, dz)
    tl.store(to + 4, 1 / load)
    tl.store(to + 5, dx * px + dy * py + dz * pz)
    tl.store(to + 6, tl.load(weights + body * 3 + 1).to(wide) * (ALPHA1 / ALPHA2 / S))
    tl.store(to + 7, tl.load(weights + body * 3 + 2).to(wide) * (BETA1 / BETA2 / S))
    arm = dx * (sx - count * cx) + dy * (sy - count * cy) + dz * (sz - count * cz)
    sign = tl.where(volume > 0, 1.0, tl.where(volume < 0, -1.0, 0.0))
    tl.store(to + NUMBERS + part, size / weight, mask=part < P)
    tl.store(to + NUMBERS + P + part, sign * arm / weight / 6, mask=part < P)


@triton.jit
def slopes(
    vertices, normal, height, corners, barycentric, sample_part, solved, out,
    P: tl.constexpr, NUMBERS: tl.constexpr, ORIGIN: tl.constexpr, V: tl.constexpr,
    ALPHA: tl.constexpr, GAMMA: tl.constexpr, SHIFTED: tl.constexpr, SQUARED: tl.constexpr,
    ALPHA2: tl.constexpr, BETA2: tl.constexpr, BLOCK: tl.constexpr,
):  # fmt: skip
    """The gradient at each sample is out[0] d m̄ + out[1] n: (B, NS · BLOCK, 2)."""
    x, y, z, h, real, slot = _sample(vertices, normal, height, corners, barycentric, ORIGIN, V, BLOCK)
    body = tl.program_id(0)
    solved += body * (NUMBERS + 2 * P)
    dtype = x.dtype
    dx, dy, dz = tl.load(solved + 1).to(dtype), tl.load(solved + 2).to(dtype), tl.load(solved + 3).to(dtype)
    share = tl.load(solved + NUMBERS + tl.load(sample_part + tl.program_id(1))).to(dtype)
    per_load, lever = tl.load(solved + 4).to(dtype), tl.load(solved + 5).to(dtype)

    density = _density(h, tl.load(solved).to(dtype), ALPHA, GAMMA)
    density_slope = tl.where(h < 0, -ALPHA, -GAMMA * density)
    arm = dx * x + dy * y + dz * z - lever
    _, pull = _wave(tl.maximum(h, 0) / ALPHA2, SQUARED)
    _, push = _wave(tl.minimum(h, 0) / BETA2, SQUARED)
    of_ground = tl.load(solved + 6).to(dtype) * pull + tl.load(solved + 7).to(dtype) * push
    to = out + (body.to(tl.int64) * tl.num_programs(1) * BLOCK + slot) * 2
    tl.store(to, tl.where(real, share - density * per_load, 0))
    tl.store(to + 1, tl.where(real, of_ground - density_slope * arm * per_load, 0))


@triton.jit
def rims(
    area, triangle_part, solved, lid_starts, lids, out,
    T: tl.constexpr, P: tl.constexpr, NUMBERS: tl.constexpr, BLOCK: tl.constexpr,
):  # fmt: skip
    """The gradient at each virtual vertex, from the triangles around it: grid (B, C) -> out (B, C, 3)."""
    body, centre = tl.program_id(0), tl.program_id(1)
    area += body.to(tl.int64) * T * 3
    of_part = solved + body * (NUMBERS + 2 * P) + NUMBERS + P
    start, end = tl.load(lid_starts + centre), tl.load(lid_starts + centre + 1)
    x = tl.zeros([BLOCK], area.dtype.element_ty)
    y, z = x, x
    for first in range(start, end, BLOCK):
        slot = first + tl.arange(0, BLOCK)
        real = slot < end
        triangle = tl.load(lids + slot, mask=real, other=0)
        d_volume = tl.load(of_part + tl.load(triangle_part + triangle)).to(x.dtype)
        ax, ay, az = _xyz(area, triangle, real)
        x += d_volume * ax
        y += d_volume * ay
        z += d_volume * az
    to = out + (body * tl.num_programs(1) + centre) * 3
    tl.store(to, tl.sum(x))
    tl.store(to + 1, tl.sum(y))
    tl.store(to + 2, tl.sum(z))


@triton.jit
def vertices(
    normal, finite, solved, area, triangle_part, around_starts, around, slopes, on_starts, on, on_weight,
    rims, centre_of, centre_share, out,
    V: tl.constexpr, C: tl.constexpr, S: tl.constexpr, T: tl.constexpr, P: tl.constexpr, NUMBERS: tl.constexpr,
    BLOCK: tl.constexpr,
):  # fmt: skip
    """The gradient at each vertex: its share of its samples', a sixth of the area normals around it, its boundary's."""
    body = tl.program_id(0)
    vertex = tl.program_id(1) * BLOCK + tl.arange(0, BLOCK)
    inside = vertex < V
    dtype = area.dtype.element_ty
    area += body.to(tl.int64) * T * 3
    slopes += body.to(tl.int64) * S * 2
    solved += body * (NUMBERS + 2 * P)
    of_part = solved + NUMBERS + P

    by_mass, by_height = tl.zeros([BLOCK], dtype), tl.zeros([BLOCK], dtype)
    slot = tl.load(on_starts + vertex, mask=inside, other=0)
    end = tl.load(on_starts + vertex + 1, mask=inside, other=0)
    for _ in range(tl.max(end - slot)):
        real = slot < end
        sample = tl.load(on + slot, mask=real, other=0)
        weight = tl.load(on_weight + slot, mask=real, other=0)
        by_mass += weight * tl.load(slopes + 2 * sample, mask=real, other=0)
        by_height += weight * tl.load(slopes + 2 * sample + 1, mask=real, other=0)
        slot += 1
    nx, ny, nz = _xyz(normal, body, True)
    x = by_mass * tl.load(solved + 1).to(dtype) + by_height * nx.to(dtype)
    y = by_mass * tl.load(solved + 2).to(dtype) + by_height * ny.to(dtype)
    z = by_mass * tl.load(solved + 3).to(dtype) + by_height * nz.to(dtype)

    slot = tl.load(around_starts + vertex, mask=inside, other=0)
    end = tl.load(around_starts + vertex + 1, mask=inside, other=0)
    for _ in range(tl.max(end - slot)):
        real = slot < end
        triangle = tl.load(around + slot, mask=real, other=0)
        d_volume = tl.load(of_part + tl.load(triangle_part + triangle, mask=real, other=0)).to(dtype)
        ax, ay, az = _xyz(area, triangle, real)
        x += d_volume * ax
        y += d_volume * ay
        z += d_volume * az
        slot += 1

    centre = tl.load(centre_of + vertex, mask=inside, other=-1)
    share = tl.load(centre_share + vertex, mask=inside, other=0)
    cx, cy, cz = _xyz(rims + body * C * 3, centre, centre >= 0)
    sound = tl.load(finite + body) != 0
    to = out + (body.to(tl.int64) * V + vertex) * 3
    tl.store(to, tl.where(sound, x + share * cx, 0), mask=inside)
    tl.store(to + 1, tl.where(sound, y + share * cy, 0), mask=inside)
    tl.store(to + 2, tl.where(sound, z + share * cz, 0), mask=inside)
