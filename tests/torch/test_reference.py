"""The oracle itself, against trimesh: whole-body integrals, and parts that add up however the surface is cut."""

from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

import ipman_rs as ip
from ipman_rs.quantities import Quantity
from ipman_rs.torch import reference
from ipman_rs.torch.reference.topology import boundary_half_edges, topology


@pytest.mark.parametrize("cut", ["as baked", "random", "slabs"])
def test_parts_add_up_to_the_body(cut):
    """Three-part junctions, islands, parts in pieces: shared virtual vertices leave no gap and no overlap."""
    model = ip.load_body("anny-lite")
    generator = np.random.default_rng(3)
    labels = {
        "as baked": model.face_parts,
        "random": generator.permutation(np.arange(len(model.faces)) % 7),
        "slabs": np.digitize(model.v_template[model.faces].mean(axis=1)[:, 1], [0.3, 0.8, 1.2, 1.4]),
    }[cut]
    template = ip.BodyTemplate(model.v_template, model.faces, labels, num_samples=10)
    vertices = model(generator.normal(scale=0.2, size=(3, 24, 3))).vertices
    rows = reference.mass_properties(reference.Posed(torch.from_numpy(vertices), template), (1.0,))
    whole, parts = rows[:, 0, 0], rows[:, 1:, 0]
    for body in range(3):
        mesh = trimesh.Trimesh(vertices[body], model.faces, process=False)
        assert parts[body].sum().item() == pytest.approx(mesh.volume, rel=1e-12)
        np.testing.assert_allclose(rows[body, 0, 2:5], mesh.center_mass, atol=1e-12)
        np.testing.assert_allclose(rows[body, 0, 5:].reshape(3, 3), mesh.moment_inertia, rtol=0, atol=1e-12)
    torch.testing.assert_close(whole, parts.sum(dim=1), rtol=1e-13, atol=0)


def test_boundary_of_two_triangles():
    faces, parts = np.array([[0, 1, 2], [0, 2, 3]]), np.array([0, 1])
    edges, owners = boundary_half_edges(faces, parts)
    inner = {(tuple(edge), owner) for edge, owner in zip(edges.tolist(), owners.tolist(), strict=True)}
    assert ((2, 0), 0) in inner
    assert ((0, 2), 1) in inner
    assert len(inner) == 6  # nothing twins the outer edges either
    together, _ = boundary_half_edges(faces, np.zeros(2, dtype=int))
    assert (0, 2) not in {tuple(edge) for edge in together.tolist()}


def test_index_tensors_are_built_once_and_outside_of_transforms(tiny):
    """The first call may come from inside vmap or grad, whose tensors die with them."""
    old = tiny.template
    template = ip.BodyTemplate(old.vertices, old.faces, old.face_parts, num_samples=30)

    def volume(v):
        return reference.part_volumes(reference.Posed(v[None], template)).sum()

    torch.func.vmap(torch.func.grad(volume))(tiny.vertices)
    mesh = topology(template, torch.device("cpu"))
    assert mesh is topology(template, torch.device("cpu"))
    assert volume(tiny.vertices[0]).isfinite()
    # Built for one template only, and gone with it.
    assert topology(old, torch.device("cpu")) is not mesh


def test_wrong_quantity_is_no_silent_default(tiny):
    with pytest.raises(KeyError):
        reference.evaluate(tiny.template, Quantity("weight"), tiny.vertices, *[None, None])
