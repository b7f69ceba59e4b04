"""Surface samples: where they lie, how they are spread, and that a seed means the same points on every machine."""

from __future__ import annotations

import itertools
import struct

import numpy as np
import pytest
import scipy.stats

import ipman_rs as ip
from tests.helpers import oracles, solids


def test_samples_are_the_regressor_times_the_vertices(lite, random_people):
    people = random_people(lite, 3, seed=2)
    regressor = lite.template.regressor()
    assert regressor.shape == (20_000, lite.num_vertices)
    assert (np.diff(regressor.indptr) == 3).all()
    points = ip.sample_surface(people, lite.template)
    # Three products and a sum in another order, on coordinates of about a metre.
    np.testing.assert_allclose(points, np.stack([regressor @ v for v in people]), rtol=0, atol=1e-15)
    np.testing.assert_allclose(points[0], oracles.samples(people[0], lite.template), rtol=0, atol=1e-15)


def test_weights_are_barycentric(blob):
    weights = blob.sample_barycentric
    assert weights.shape == (300, 3)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=0, atol=4e-16)


def test_parts_are_those_of_the_faces(blob):
    np.testing.assert_array_equal(blob.sample_parts, blob.face_parts[blob.sample_faces])
    assert (np.diff(blob.sample_faces) >= 0).all()


def test_uniform_on_area():
    """20,000 points on a long box: counts by chi-square against the faces' areas, and within the faces against the law
    of a uniform triangle, P(weight ≤ x) = 1 − (1 − x)². The seed is fixed, so the test cannot fail by chance; a wrong
    density by 3 % would."""
    vertices, faces = solids.box((0.2, 2.0, 0.7))
    template = ip.BodyTemplate(vertices, faces, num_samples=20_000, seed=4)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    counts = np.bincount(template.sample_faces, minlength=len(faces))
    assert scipy.stats.chisquare(counts, 20_000 * area / area.sum()).pvalue > 1e-3
    for k in range(3):
        law = scipy.stats.kstest(template.sample_barycentric[:, k], lambda x: 1 - (1 - x) ** 2)
        assert law.pvalue > 1e-3


def chacha8(seed):
    """The 64-bit numbers of ChaCha with 8 rounds, its key expanded from `seed` by PCG32, as the rand crates define."""
    key = b""
    for _ in range(8):
        seed = (seed * 6364136223846793005 + 11634580027462260723) % 2**64
        x, turn = (((seed >> 18) ^ seed) >> 27) % 2**32, seed >> 59
        key += struct.pack("<I", (x >> turn | x << (32 - turn) if turn else x) % 2**32)

    def quarter(s, a, b, c, d):
        for p, q, r, turn in ((a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)):
            s[p] = (s[p] + s[q]) % 2**32
            s[r] ^= s[p]
            s[r] = (s[r] << turn | s[r] >> (32 - turn)) % 2**32

    for counter in itertools.count():
        start = [*struct.unpack("<4I", b"expand 32-byte k"), *struct.unpack("<8I", key), counter, 0, 0, 0]
        state = list(start)
        for _ in range(4):
            for column in range(4):
                quarter(state, column, column + 4, column + 8, column + 12)
            for k in range(4):
                quarter(state, k, 4 + (k + 1) % 4, 8 + (k + 2) % 4, 12 + (k + 3) % 4)
        words = [(a + b) % 2**32 for a, b in zip(state, start, strict=True)]
        yield from (low | high << 32 for low, high in zip(words[::2], words[1::2], strict=True))


@pytest.mark.parametrize("seed", [0, 1, 2**64 - 1])
def test_the_sequence_of_a_seed(seed):
    """The generator written out here, from its definition: a change of generator or of order would change every
    published figure. Face by cumulated area, then (1 − √r, √r (1 − s), √r s)."""
    vertices, faces = solids.TETRAHEDRON
    template = ip.BodyTemplate(vertices, faces, num_samples=50, seed=seed)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    numbers = ((word >> 11) / 2**53 for word in chacha8(seed))
    picks = []
    for _ in range(50):
        target = next(numbers) * area.sum()
        face = int(np.searchsorted(np.cumsum(area), target, side="right"))
        root, s = np.sqrt(next(numbers)), next(numbers)
        picks.append((face, (1 - root, root * (1 - s), root * s)))
    picks.sort(key=lambda pick: pick[0])
    np.testing.assert_array_equal(template.sample_faces, [face for face, _ in picks])
    np.testing.assert_allclose(template.sample_barycentric, [weights for _, weights in picks], rtol=0, atol=1e-15)


def test_same_seed_same_samples_other_seed_others(blob):
    def make(seed):
        return ip.BodyTemplate(blob.vertices, blob.faces, blob.face_parts, num_samples=300, seed=seed)

    again, other = make(3), make(4)
    np.testing.assert_array_equal(again.sample_faces, blob.sample_faces)
    np.testing.assert_array_equal(again.sample_barycentric, blob.sample_barycentric)
    assert not np.array_equal(other.sample_barycentric, blob.sample_barycentric)


def test_samples_move_with_the_body(blob, rng):
    """Linear in the vertices: the samples of a turned and shifted body are the turned and shifted samples."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    still = ip.sample_surface(blob.vertices, blob)
    moved = ip.sample_surface(blob.vertices @ turn + [5.0, -2.0, 1.0], blob)
    np.testing.assert_allclose(moved, still @ turn + [5.0, -2.0, 1.0], rtol=0, atol=1e-14)


def test_one_sample_is_enough():
    template = ip.BodyTemplate(*solids.TETRAHEDRON, num_samples=1)
    assert ip.sample_surface(template.vertices, template).shape == (1, 3)
    assert template.regressor().shape == (1, 4)
