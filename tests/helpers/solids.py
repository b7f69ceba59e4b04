"""Small bodies with known answers, and every numpy function as one call."""

from __future__ import annotations

import dataclasses

import numpy as np
import trimesh

import ipman_rs as ip

METHODS = ("pcom", "vertex_mean", "sample_mean", "face_area", "exact")
TETRAHEDRON = (
    np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
)


def box(size=(0.6, 1.6, 0.4)):
    """Vertices and faces of a box, standing on y = 0 above the origin."""
    mesh = trimesh.creation.box(size)
    return np.array(mesh.vertices) + [0.0, size[1] / 2, 0.0], np.array(mesh.faces)


def plate(num_samples=64):
    """A plate of 1 m × 1 m × 2 cm with its underside on y = 0, whose samples are spread over two parts."""
    vertices, faces = box((1.0, 0.02, 1.0))
    return ip.BodyTemplate(vertices, faces, (np.arange(12) % 4 == 0).astype(int), num_samples=num_samples)


def blob(subdivisions=2, num_samples=300, seed=3):
    """An ellipsoid of human size, four parts that meet in pairs and threes; asymmetric, so that no term vanishes."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions)
    vertices = np.array(mesh.vertices) * [0.3, 0.8, 0.25] + [0.05, 0.8, -0.1]
    faces = np.array(mesh.faces)
    centre = vertices[faces].mean(axis=1)
    parts = np.where(centre[:, 1] > 0.9, (centre[:, 2] > -0.1).astype(int), 2 + (centre[:, 0] > 0.1).astype(int))
    return ip.BodyTemplate(vertices, faces, parts, num_samples=num_samples, seed=seed)


def posed(template, count, seed=0):
    """Bodies (count, V, 3): the template's shape bent at random, their feet from 5 cm below y = 0 to 5 cm above."""
    rng = np.random.default_rng(seed)
    bend = np.eye(3) + 0.15 * rng.normal(size=(count, 3, 3))
    bodies = template.vertices @ bend + 0.005 * rng.normal(size=(count, template.num_vertices, 3))
    lowest = bodies[..., 1].min(axis=-1, keepdims=True)
    bodies[..., 1] += np.linspace(-0.05, 0.05, count)[:, None] - lowest
    return bodies


def _support(vertices, template, ground):
    found = ip.base_of_support(vertices, template, ground)
    fields = [field.name for field in dataclasses.fields(found) if field.name != "polygon"]
    return tuple(getattr(found, name) for name in fields)


def _solid(vertices, template, ground):
    solid = ip.mass_properties(vertices, template)
    whole, parts = (tuple(vars(each)[name] for name in ("volume", "mass", "center", "inertia"))
                    for each in (solid, solid.parts))  # fmt: skip
    return whole + parts


# name: (vertices, template, ground) -> arrays that begin with the batch's dimensions
EVERY = {
    "part_volumes": lambda v, t, g: (ip.part_volumes(v, t),),
    "mass_properties": _solid,
    "sample_surface": lambda v, t, g: (ip.sample_surface(v, t),),
    **{
        f"center_of_mass-{method}": lambda v, t, g, method=method: (ip.center_of_mass(v, t, method),)
        for method in METHODS
    },
    "pressure": lambda v, t, g: (ip.pressure(v, t, g),),
    "center_of_pressure": lambda v, t, g: (ip.center_of_pressure(v, t, g),),
    "base_of_support": _support,
    "support_margin": lambda v, t, g: (ip.support_margin(v, t, g),),
    "bose-hull": lambda v, t, g: (ip.bose(v, t, g),),
    "bose-lp": lambda v, t, g: (ip.bose(v, t, g, method="lp"),),
    "stability_loss": lambda v, t, g: (ip.stability_loss(v, t, g),),
    "ground_loss-samples": lambda v, t, g: ip.ground_loss(v, t, g),
    "ground_loss-vertices": lambda v, t, g: ip.ground_loss(v, t, g, points="vertices", curve="tanh_of_square"),
    "balance_cost": lambda v, t, g: (ip.balance_cost(v, t, g),),
    "body_status": lambda v, t, g: (ip.body_status(v, t, g),),
}
