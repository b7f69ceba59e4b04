"""The signed margin, on both paths, against scipy's qhull and against what a ruler gives for hulls without area."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy.spatial import ConvexHull

import ipman_rs as ip
import ipman_rs.torch as ipt
from ipman_rs.torch.reference.support import nearest_edge, signed_distance

F64 = torch.float64
PATHS = pytest.mark.parametrize("forced", [False, True], ids=["core", "reference"])


def margin_by_qhull(points, target):
    """Distance to the hull's boundary, positive inside."""
    hull = ConvexHull(points)
    inside = -(hull.equations[:, :2] @ target + hull.equations[:, 2])
    if (inside >= 0).all():
        return inside.min()
    starts, ends = points[hull.simplices[:, 0]], points[hull.simplices[:, 1]]
    along = ends - starts
    t = np.clip(((target - starts) * along).sum(1) / (along**2).sum(1), 0, 1)
    return -np.linalg.norm(starts + t[:, None] * along - target, axis=1).min()


def margin(vertices, template, ground, forced, **options):
    if not forced:
        return ipt.support_margin(vertices, template, ground, **options)
    with ipt.dispatch._reference_path():
        return ipt.support_margin(vertices, template, ground, **options)


@pytest.mark.slow
@PATHS
def test_embedded_bodies_against_qhull(poses, forced):
    vertices = poses.vertices.clone()
    vertices[..., 1] -= vertices[..., 1].amin(dim=-1, keepdim=True)
    ours = margin(vertices, poses.template, poses.ground, forced)
    samples = ip.sample_surface(vertices.numpy(), poses.template)
    centres = ip.center_of_mass(vertices.numpy(), poses.template)
    for body, (points, centre) in enumerate(zip(samples, centres, strict=True)):
        contact = points[np.abs(points[:, 1]) < 0.1][:, [0, 2]]
        assert ours[body].item() == pytest.approx(margin_by_qhull(contact, centre[[0, 2]]), abs=1e-12)
    assert (ours > 0).any()
    assert (ours < 0).any()


@pytest.mark.slow
def test_nearest_edge_of_random_clouds():
    """Clouds of 3 to 200 points, on circles (every point a corner), on grids (many on one line) and with copies."""
    generator = np.random.default_rng(4)
    for trial in range(300):
        count = int(generator.integers(3, 200))
        kind = trial % 3
        if kind == 0:
            points = generator.normal(size=(count, 2)) * 10.0 ** generator.uniform(-3, 1)
        elif kind == 1:
            angle = generator.uniform(0, 2 * np.pi, size=count)
            points = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        else:
            points = generator.integers(0, 6, size=(count, 2)).astype(float)
            if np.linalg.matrix_rank(points - points[0]) < 2:
                continue
        target = points.mean(axis=0) + generator.normal(size=2) * points.std() * 0.7
        tensor = torch.from_numpy(np.concatenate([points, points[:5]]))[None]
        mask = torch.ones(tensor.shape[:2], dtype=torch.bool)
        start, end = tensor[0][nearest_edge(tensor, mask, torch.from_numpy(target)[None])[0]]
        ours = signed_distance(start, end, torch.from_numpy(target)).item()
        assert ours == pytest.approx(margin_by_qhull(points, target), abs=1e-12 * np.abs(points).max()), trial


def body_with_contacts(contacts, height=1.0):
    """A tetrahedral body in the air whose samples do not touch, joined by thin spikes to the contacts: here simply a
    template whose samples are read at its vertices, by sampling vanishing triangles there."""
    contacts = np.asarray(contacts, dtype=float)
    tiny = 1e-9
    corner = np.array([[0, 0, 0], [tiny, 0, 0], [0, 0, tiny], [0, tiny, 0]])
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    blob = np.array([[0, 0, 0], [0.3, 0, 0], [0, 0, 0.3], [0, 0.3, 0]]) + [0, height, 0]
    blob[:, [0, 2]] -= blob[:, [0, 2]].mean(axis=0)
    solids = [blob, *(corner + contact for contact in contacts)]
    rest = np.concatenate([blob, *(corner * 1e9 * 0.3 + [index, 0, 0] for index in range(1, len(solids)))])
    every = np.concatenate([faces + 4 * index for index in range(len(solids))])
    template = ip.BodyTemplate(rest, every, num_samples=400)
    return template, torch.tensor(np.concatenate(solids))[None]


@PATHS
@pytest.mark.parametrize(
    ("contacts", "expected"),
    [
        ([[0.3, 0, 0.4]], -0.5),
        ([[0.3, 0, 0.4], [0.3, 0, 0.4]], -0.5),
        ([[-1, 0, 0.2], [1, 0, 0.2]], -0.2),
        ([[0.3, 0, 0.4], [1, 0, 0.4]], -0.5),
        ([[-1, 0, -1 - 0.5], [0, 0, -0.5], [1, 0, 1 - 0.5]], -0.5 / math.sqrt(2)),
        ([[-1, 0, -0.7 + 0.01], [0.1, 0, 0.07 + 0.01], [0.5, 0, 0.35 + 0.01]], -0.01 / math.hypot(1, 0.7)),
        ([[-1, 0, -1], [1, 0, -1], [0, 0, 2]], None),
    ],
    ids=["one", "one twice", "two", "two, beyond the end", "line", "line, close by", "triangle"],
)
def test_few_contacts(contacts, expected, forced):
    """One, two and collinear contacts: minus the distance, with a gradient that pulls the CoM towards them."""
    template, vertices = body_with_contacts(contacts)
    vertices.requires_grad_()
    value = margin(vertices, template, ipt.Ground(), forced, method="exact")
    (gradient,) = torch.autograd.grad(value.sum(), vertices)
    assert gradient.isfinite().all()
    if expected is None:
        expected = margin_by_qhull(np.array(contacts)[:, [0, 2]], np.zeros(2))
        assert expected > 0
    # The contacts are 1e-9 m wide.
    assert value.item() == pytest.approx(expected, abs=1e-8)
    # Moving body and contacts together changes nothing; moving the body alone, whose volume is all there is, does.
    assert gradient.sum(dim=1).norm().item() < 1e-6
    assert gradient[0, :4].sum(dim=0)[[0, 2]].norm().item() == pytest.approx(1.0, abs=1e-6)


@PATHS
def test_collinear_contacts_in_any_direction(forced):
    """Rounding makes a sliver of a line; it must not turn into an inside."""
    generator = np.random.default_rng(9)
    for _ in range(40):
        direction = generator.normal(size=2)
        direction /= np.linalg.norm(direction)
        normal = np.array([-direction[1], direction[0]])
        distance = 10.0 ** generator.uniform(-6, 0)
        along = generator.uniform(-1, 1, size=6)
        along[:2] = -1, 1
        line = along[:, None] * direction + distance * normal
        contacts = np.stack([line[:, 0], np.zeros(6), line[:, 1]], axis=1)
        template, vertices = body_with_contacts(contacts)
        value = margin(vertices, template, ipt.Ground(), forced, method="exact").item()
        assert value == pytest.approx(-distance, abs=3e-9)


@PATHS
def test_released_contact_counts_the_sunk_and_needs_more_than_ten(tiny, forced):
    sunk = tiny.vertices - 1.0 * tiny.ground.normal
    assert (margin(sunk - tiny.ground.normal, tiny.template, tiny.ground, forced) == -math.inf).all()
    assert margin(sunk - tiny.ground.normal, tiny.template, tiny.ground, forced, contact="released").isfinite().all()
    few = ip.BodyTemplate(tiny.template.vertices, tiny.template.faces, num_samples=10)
    assert (margin(sunk, few, tiny.ground, forced, contact="released") == -math.inf).all()
    more = ip.BodyTemplate(tiny.template.vertices, tiny.template.faces, num_samples=11)
    assert margin(sunk - tiny.ground.normal, more, tiny.ground, forced, contact="released").isfinite().all()


def test_hull_and_programme_agree(tiny):
    vertices = tiny.vertices.repeat(50, 1, 1)
    vertices = vertices + torch.randn(150, 1, 3, generator=torch.Generator().manual_seed(1), dtype=F64) * 0.03
    vertices[:, :20] += 0.15 * torch.randn(150, 1, 3, generator=torch.Generator().manual_seed(2), dtype=F64)
    by_hull = ipt.bose(vertices, tiny.template, tiny.ground)
    by_programme = ipt.bose(vertices, tiny.template, tiny.ground, method="lp")
    assert by_hull.dtype == torch.bool
    assert by_hull.any()
    assert not by_hull.all()
    assert torch.equal(by_hull, by_programme)
