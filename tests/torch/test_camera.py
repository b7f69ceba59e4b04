"""A body seen by an augmented camera comes back to the world as it stood there, or as its upright mirror image."""

from __future__ import annotations

import math

import pytest
import torch

import ipman_rs.torch as ipt

F64 = torch.float64


def turn(axis: torch.Tensor, angle: float) -> torch.Tensor:
    x, y, z = (axis / axis.norm()).tolist()
    return torch.linalg.matrix_exp(angle * torch.tensor([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=F64))


def turn_image(degrees_clockwise: float) -> torch.Tensor:
    """What turning the picture does to camera coordinates, written independently of the code: right goes to down."""
    angle = math.radians(degrees_clockwise)
    right, down = [math.cos(angle), math.sin(angle), 0.0], [-math.sin(angle), math.cos(angle), 0.0]
    return torch.tensor([right, down, [0.0, 0.0, 1.0]], dtype=F64).T


@pytest.fixture
def scene() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """A body standing on y = 0 in the world, and the extrinsics of a tilted camera."""
    generator = torch.Generator().manual_seed(3)
    body = torch.rand(50, 3, generator=generator, dtype=F64) * torch.tensor([0.5, 1.7, 0.3], dtype=F64)
    body[0, 1] = 0.0
    camera = turn(torch.tensor([0.3, -0.8, 0.2], dtype=F64), 2.1) @ turn(torch.tensor([1.0, 0, 0], dtype=F64), 2.6)
    return body, camera, torch.tensor([0.2, -0.4, 3.5], dtype=F64)


@pytest.mark.parametrize("degrees", [0.0, 30.0, -75.0, 180.0])
@pytest.mark.parametrize("flip", [False, True])
def test_vertices_come_back(scene, degrees, flip):
    world, R, t = scene
    seen = (world @ R.T + t) @ turn_image(degrees).T
    expected = world.clone()
    if flip:
        seen = seen * torch.tensor([-1.0, 1, 1], dtype=F64)
        expected[:, 0] *= -1  # across the vertical plane x = 0: heights stay
    translation = seen.mean(dim=0)

    vertices, place = ipt.camera_to_world(
        seen - translation, translation, R, t, flip=flip, rotation=math.radians(degrees)
    )

    torch.testing.assert_close(vertices + place, expected, rtol=0, atol=1e-12)
    assert abs((vertices + place)[:, 1].min().item()) < 1e-12


@pytest.mark.parametrize("flip", [False, True])
def test_orientation_is_a_rotation_about_the_pelvis(scene, flip):
    """The body model x -> O (x − pelvis) + pelvis + transl, called with the world parameters, gives the world body."""
    world, R, t = scene
    pelvis = torch.tensor([0.03, 0.9, -0.02], dtype=F64)
    orientation, transl = turn(torch.tensor([0.1, 1.0, 0.2], dtype=F64), 0.7), torch.tensor([0.5, 0.1, -0.3], dtype=F64)

    def model(rest, O, place):  # noqa: E741
        return (rest - pelvis_of(rest)) @ O.T + pelvis_of(rest) + place

    left_right = torch.tensor([-1.0, 1, 1], dtype=F64) if flip else torch.ones(3, dtype=F64)
    rest = torch.cat([world, pelvis[None]])

    def pelvis_of(rest):
        return rest[-1]

    # A flipped image shows the mirrored body: rest pose, shape and orientation are those of the other side.
    augmentation = torch.diag(left_right) @ turn_image(20.0)
    rest_seen = rest * left_right
    orientation_seen = augmentation @ R @ orientation @ torch.diag(left_right)
    root_seen = augmentation @ (R @ (pelvis + transl) + t)
    transl_seen = root_seen - pelvis_of(rest_seen)
    seen = model(rest_seen, orientation_seen, transl_seen)
    torch.testing.assert_close(seen, (model(rest, orientation, transl) @ R.T + t) @ augmentation.T)

    O_w, transl_w = ipt.camera_to_world(
        orientation_seen, transl_seen, R, t, flip=flip, rotation=math.radians(20.0), pelvis=pelvis_of(rest_seen)
    )

    assert torch.linalg.det(O_w).item() == pytest.approx(1.0, abs=1e-12)
    expected = model(rest, orientation, transl) * left_right
    torch.testing.assert_close(model(rest_seen, O_w, transl_w), expected, rtol=0, atol=1e-12)

    # Without `pelvis` the translation is where the joint lies: the same place, said otherwise.
    _, root_w = ipt.camera_to_world(orientation_seen, root_seen, R, t, flip=flip, rotation=math.radians(20.0))
    torch.testing.assert_close(root_w, transl_w + pelvis_of(rest_seen), rtol=0, atol=1e-12)


def test_forgetting_the_flip_tilts_the_body(scene):
    """The trap the camera has to follow out of: with the camera left as it was, a flipped body no longer stands."""
    world, R, t = scene
    seen = (world @ R.T + t) * torch.tensor([-1.0, 1, 1], dtype=F64)
    vertices, place = ipt.camera_to_world(seen, torch.zeros(3, dtype=F64), R, t)
    heights = (vertices + place)[:, 1]
    assert (heights - world[:, 1]).abs().max() > 0.1


def test_one_augmentation_a_body_and_gradients(scene):
    world, R, t = scene
    flip, rotation = torch.tensor([False, True, True]), torch.tensor([0.3, 0.0, -1.1], dtype=F64)
    bodies = torch.stack([world, world + 0.1, world - 0.1]).requires_grad_()
    place = torch.zeros(3, 3, dtype=F64)
    together, places = ipt.camera_to_world(bodies, place, R, t, flip=flip, rotation=rotation)
    for index in range(3):
        alone, place_alone = ipt.camera_to_world(
            bodies[index], place[index], R, t, flip=bool(flip[index]), rotation=float(rotation[index])
        )
        torch.testing.assert_close(together[index], alone, rtol=0, atol=1e-14)
        torch.testing.assert_close(places[index], place_alone, rtol=0, atol=1e-14)
    assert torch.autograd.gradcheck(
        lambda b: ipt.camera_to_world(b, place, R, t, flip=flip, rotation=rotation)[0], (bodies,), fast_mode=True
    )


def test_the_mirrored_body_keeps_its_volume_outside_in(scene):
    """Vertices of a flipped estimate: its mesh is a proper one, so the way to the world must not mirror it."""
    _, R, t = scene
    corners = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=F64)
    world, _ = ipt.camera_to_world(corners, torch.zeros(3, dtype=F64), R, t, flip=True, rotation=0.4)
    assert torch.linalg.det(world[1:] - world[0]).item() == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("argument", "value"),
    [("vertices_or_orientation", torch.zeros(4, 2)), ("translation", torch.zeros(2)), ("R", torch.eye(4))],
)
def test_wrong_shapes_are_named(argument, value):
    arguments = {
        "vertices_or_orientation": torch.zeros(5, 3),
        "translation": torch.zeros(3),
        "R": torch.eye(3),
        "t": torch.zeros(3),
    }
    with pytest.raises(ValueError, match=argument):
        ipt.camera_to_world(**{**arguments, argument: value})


def test_autocast_leaves_the_precision(scene):
    world, R, t = (tensor.float() for tensor in scene)
    plain, _ = ipt.camera_to_world(world, t, R, t)
    with torch.autocast("cpu", torch.bfloat16):
        cast, _ = ipt.camera_to_world(world, t, R, t)
    assert torch.equal(plain, cast)
