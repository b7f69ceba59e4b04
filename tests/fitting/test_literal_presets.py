"""The literal presets against upstream's numbers, and the terms and blocks that only bodies with fingers and a face
have.

The numbers are those of cfg_files/fit_smplx.yaml of vchoutas/smplify-x (3.17: its fit_single_frame.py) and of
configs/fit_smplx_singleview.yaml of muelea/smplify-xmc 8b50d56, and what their losses make of them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import ipman_rs.torch as ipt
from ipman_rs.body import poses
from ipman_rs.body.landmarks import skin_points
from ipman_rs.data.keypoints import openpose
from ipman_rs.fitting import config, start, variables
from ipman_rs.fitting.candidate import Candidate
from ipman_rs.fitting.fit import fit
from ipman_rs.fitting.geodesics import geodesics
from ipman_rs.fitting.landmarks import Landmarks
from ipman_rs.fitting.objective import Objective
from ipman_rs.fitting.problem import Presented
from ipman_rs.fitting.result import fit_results, parameters
from ipman_rs.fitting.rotations import matrix, vector
from ipman_rs.fitting.terms.contact_normals import ContactNormals
from ipman_rs.fitting.terms.expression_prior import ExpressionPrior
from ipman_rs.fitting.terms.hand_prior import HandPrior
from ipman_rs.fitting.terms.jaw_prior import JawPrior
from ipman_rs.fitting.terms.pose_prior import PosePrior
from ipman_rs.fitting.terms.presented_orient import PresentedOrient
from ipman_rs.fitting.terms.reprojection import Reprojection
from tests.helpers import fit_terms_cases as cases

# A column a stage. data_weight is 1000 / H of an image H high: 4 of squares in one 500 high.
SMPLIFY_X = {
    "body_pose_prior_weights": (4.04e2, 4.04e2, 57.4, 4.78, 4.78),
    "hand_pose_prior_weights": (4.04e2, 4.04e2, 57.4, 4.78, 4.78),
    "jaw_pose_prior_weights": (
        (4.04e3, 4.04e4, 4.04e4), (4.04e3, 4.04e4, 4.04e4), (574, 5740, 5740), (47.8, 478, 478), (47.8, 478, 478)
    ),
    "shape_weights": (1e2, 5e1, 1e1, 5, 5),
    "expr_weights": (1e2, 5e1, 1e1, 5, 5),
    "coll_loss_weights": (0, 0, 0, 0.01, 1),
    "hand_joints_weights": (0, 0, 0, 0.1, 2),
    "joints_to_ign": (1, 9, 12),
}  # fmt: skip
SMPLIFY_XMC = {
    "body_pose_prior_weights": (0, 15000, 10000),
    "mimicked_contact_weights": (0, 250000, 125000),
    "scopti_weights": (0, 0, 1000),
    "shape_weights": (100, 10, 10),
    "expr_weights": (0, 0, 0),
    "hand_pose_prior_weights": (0, 10, 5),
    "jaw_pose_prior_weights": ((0, 0, 0), (0, 0, 0), (0, 0, 0)),
    "hand_joints_weights": (0.5, 2, 1),
    "body_global_orient_weights": (10, 0, 0),  # its loss is taken only where the pose prior weighs 0
    "joints_to_ign": (1,),
}
DATA, PHYSICS = (1000 / 500) ** 2, 1e4


def squared(numbers):
    return tuple(number**2 for number in numbers)


def weights(preset: str, term: str) -> tuple[float, ...]:
    return tuple(stage.weights.get(term, 0) for stage in config.load(preset).stages)


def option(preset: str, term: str, name: str) -> list:
    loaded = config.load(preset)
    return [stage.term_options(loaded.terms)[term].get(name) for stage in loaded.stages]


@pytest.mark.parametrize("preset", ["smplify-x", "ipman-o-star"])
def test_smplify_x_s_numbers(preset):
    upstream = SMPLIFY_X
    assert weights(preset, "reprojection") == (DATA,) * 5
    body = upstream["body_pose_prior_weights"]
    for term, expected in {
        "pose_prior": squared(body),
        "joint_limits": squared(body),  # ours, beside the prior
        "hand_prior": squared(upstream["hand_pose_prior_weights"]),
        "shape_prior": squared(upstream["shape_weights"]),
        "expression_prior": squared(upstream["expr_weights"]),
        "bending": tuple(3.17 * weight for weight in body),
        "self_penetration": upstream["coll_loss_weights"],
    }.items():
        assert weights(preset, term) == pytest.approx(expected, rel=1e-12), term
    jaw = np.array(weights(preset, "jaw_prior"))[:, None] * np.square(option(preset, "jaw_prior", "axes"))
    np.testing.assert_allclose(jaw, np.square(upstream["jaw_pose_prior_weights"]), rtol=1e-12)
    assert tuple(option(preset, "reprojection", "hands")) == upstream["hand_joints_weights"]
    ignored = {openpose.NAMES[index]: 0 for index in upstream["joints_to_ign"]}
    assert option(preset, "reprojection", "weights") == [ignored] * 5
    assert option(preset, "reprojection", "rho") == [100] * 5
    loaded = config.load(preset)
    physics = (0, 0, 0, 0, PHYSICS) if preset == "ipman-o-star" else (0,) * 5
    assert weights(preset, "stability") == weights(preset, "ground") == physics
    assert loaded.start == {"search": "mean", "yaws": 2}
    own = {"orient", "pose", "face", "betas", "expression"}
    assert [set(stage.free) - own for stage in loaded.stages[:4]] == [set()] * 4
    assert all(own <= set(stage.free) for stage in loaded.stages)
    assert {stage.options.iterations for stage in loaded.stages} == {30 * 30}
    assert set().union(*(stage.weights for stage in loaded.stages)) <= {
        "reprojection", "pose_prior", "joint_limits", "hand_prior", "jaw_prior", "shape_prior", "expression_prior",
        "bending", "self_penetration", "stability", "ground",
    }  # fmt: skip


@pytest.mark.parametrize("preset", ["smplify-xmc", "ipman-o"])
def test_smplify_xmc_s_numbers(preset):
    upstream, literal = SMPLIFY_XMC, preset == "smplify-xmc"
    for term, expected in {
        "reprojection": (DATA,) * 3,
        "presented_pose": upstream["body_pose_prior_weights"],
        "presented_contact": upstream["mimicked_contact_weights"],
        "self_contact": upstream["scopti_weights"],
        "contact_normals": tuple(0.1 * (weight > 0) for weight in upstream["scopti_weights"]),
        "measured_shape": upstream["shape_weights"],
        "expression_prior": squared(upstream["expr_weights"]),
        "jaw_prior": (0, 0, 0),
        "hand_prior": squared(upstream["hand_pose_prior_weights"]),
        "presented_orient": upstream["body_global_orient_weights"] if literal else (0, 0, 0),
        "stability": (0 if literal else PHYSICS,) * 3,
        "ground": (0 if literal else PHYSICS,) * 3,
    }.items():
        assert weights(preset, term) == pytest.approx(expected, rel=1e-12), term
    assert tuple(option(preset, "reprojection", "hands")) == upstream["hand_joints_weights"]
    limbs = {openpose.NAMES[index]: 2 for index in (3, 6, 10, 13)}  # data_loader.py: elbows and knees
    ignored = {openpose.NAMES[index]: 0 for index in upstream["joints_to_ign"]}
    assert option(preset, "reprojection", "weights") == [limbs | ignored] * 3
    assert option(preset, "reprojection", "rho") == [100] * 3
    free = [set(stage.free) for stage in config.load(preset).stages]
    camera = {"camera_orient", "camera_transl", "log_focal", "betas"}
    assert free == [camera | ({"orient"} if literal else set()), camera | {"pose"}, camera | {"pose"}]


def test_ours_keep_their_own():
    assert weights("balanced", "hand_prior") == (0, 5, 5)
    assert {name for stage in config.load("balanced").stages for name in stage.weights} == {
        "reprojection", "measured_shape", "presented_pose", "hand_prior", "balance", "ground"
    }  # fmt: skip
    assert not any(stage.terms for name in ("balanced", "markers") for stage in config.load(name).stages)


def test_weights_of_points_by_stage():
    """Hands weigh as the stage says, ignored points nothing, confidence all the same."""
    problem, given = cases.smplx_observed(1)
    names = problem.landmarks.names
    confidence = torch.full_like(problem.confidence, 0.5)
    loaded = config.load("smplify-x")
    for stage, hands in zip(loaded.stages, SMPLIFY_X["hand_joints_weights"], strict=True):
        options = stage.term_options(loaded.terms)["reprojection"]
        weight = Reprojection(replace(problem, confidence=confidence), **options).weight[0, :, 0]
        expected = {"left_index1": hands, "right_pinky_tip": hands, "left_thumb": hands, "right_wrist": 1, "nose": 1}
        expected |= {"mid_shoulder": 0, "left_hip": 0, "right_hip": 0, "left_knee": 1, "neck": 1, "jaw": 1}
        assert {name: float(weight[names.index(name)]) for name in expected} == {
            name: 0.5 * value for name, value in expected.items()
        }


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("terms: {reprojection: {hand: 1}}", "stage 0, terms, reprojection: expected some of rho, weights, hands, got"),
        ("terms: {ground: {pul: 1}}", "stage 0, terms, ground: expected some of pull, preset, samples, only_static"),
        ("terms: {hands: {}}", "stage 0, terms: expected some of reprojection"),
        ("terms: {reprojection: 3}", "stage 0, terms, reprojection: expected names with values, got 3"),
    ],
)
def test_wrong_options_of_a_stage_are_refused(change, message, tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(f"stages: [{{free: [pose], weights: {{reprojection: 1}}, {change}}}]")
    with pytest.raises(ValueError, match=message):
        config.load(path)


def test_an_unknown_search_is_refused(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("start: {search: best}\nstages: [{free: [pose], weights: {reprojection: 1}}]")
    with pytest.raises(ValueError, match="start, search: expected one of body, mean, camera, points, got 'best'"):
        config.load(path)


def test_blocks_are_the_whole_pose():
    body = cases.smplx_body()
    pose = torch.arange(2 * 55 * 3.0).reshape(2, 55, 3)
    blocks = variables.pose_blocks(pose, body.body)
    assert {name: tuple(block.shape) for name, block in blocks.items()} == {
        "orient": (2, 3), "pose": (2, 51, 3), "face": (2, 3, 3)
    }  # fmt: skip
    assert torch.equal(blocks["face"], pose[:, 22:25])
    assert torch.equal(variables.full_pose(blocks, body.body), pose)


def test_landmarks_with_expression():
    """The cut body's points are the whole body's."""
    body = cases.smplx_body()
    problem, given = cases.smplx_observed(3)
    seen = Candidate(problem, given)
    posed = body(seen.full_pose, given["betas"], given["transl"], given["expression"])
    assert torch.equal(seen.vertices, posed.vertices)
    nose = problem.landmarks.names.index("nose")
    jaw = problem.landmarks.names.index("jaw")
    expected = posed.vertices[:, skin_points(body.body)["nose"]]
    torch.testing.assert_close(seen.landmarks[:, nose], expected, rtol=0, atol=1e-13)
    torch.testing.assert_close(seen.landmarks[:, jaw], posed.joints[:, 22], rtol=0, atol=1e-13)
    still = Candidate(problem, {**given, "expression": 0 * given["expression"]})
    assert (still.landmarks - seen.landmarks)[:, [nose, jaw]].abs().amax() > 1e-4


FREE = ("orient", "pose", "face", "betas", "expression", "transl", "camera_transl", "log_focal")


@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize("name", ["reprojection", "expression_prior"])
def test_closed_jacobians_with_a_face(name, short):
    """Against forward mode; `short`: with fewer betas than the body has, where expressions follow them."""
    problem, given = cases.smplx_observed(2)
    if short:
        given["betas"] = given["betas"][:, :4]
    given["expression"] = given["expression"] + 0.3
    objective = Objective(problem, given, FREE, {name: 2.0})
    points = variables.pack(given, FREE).numpy() + 0.01
    values, slopes = objective._jacobian(points, [name])
    expected, expected_slopes = objective._by_forward_mode(points, [name])
    torch.testing.assert_close(values, expected, rtol=1e-12, atol=1e-11)
    assert expected_slopes.abs().max() > 0
    torch.testing.assert_close(slopes, expected_slopes, rtol=0, atol=1e-10 * float(expected_slopes.abs().max()))
    for body in range(2):
        alone = objective.rows([body])._jacobian(points[body : body + 1], [name])
        assert torch.equal(alone[0][0], values[body])
        assert torch.equal(alone[1][0], slopes[body])


PRIORS = {"hand_prior": HandPrior, "jaw_prior": JawPrior, "expression_prior": ExpressionPrior}


@pytest.mark.parametrize("name", PRIORS)
def test_priors_of_hands_and_face(name):
    problem, given = cases.smplx_observed(3)
    term = PRIORS[name](problem)
    blocks = ("pose", "face", "expression")
    assert torch.autograd.gradcheck(
        lambda *parts: term.residuals(Candidate(problem, {**given, **dict(zip(blocks, parts, strict=True))}))[:, ::7],
        tuple(given[block].requires_grad_() for block in blocks),
        check_forward_ad=True,
        fast_mode=True,
    )
    cases.assert_rows_are_alone(PRIORS[name], problem, {name: value.detach() for name, value in given.items()})


@pytest.mark.parametrize("name", PRIORS)
def test_priors_of_what_a_body_lacks_are_zero(name):
    problem = cases.problem(2)
    values = cases.variables(2)
    values["pose"][:, 21:] = 0
    cost, gradients = cases.cost_and_gradient(PRIORS[name](problem), values)
    assert torch.equal(cost, torch.zeros(2, dtype=torch.float64))
    assert not any(gradient.any() for gradient in gradients.values())


def test_hand_prior_is_of_the_components():
    """Upstream's prior: Σ c² of a hand that is Σ c_k component_k, of 12 of them as of all."""
    problem, given = cases.smplx_observed(1)
    hands = problem.body.body.hands
    weights = np.random.default_rng(0).normal(size=(2, 12))
    given["pose"][:, 21:] = torch.from_numpy(hands.from_components(*weights))
    cost = HandPrior(problem).cost(Candidate(problem, given))
    assert cost.item() == pytest.approx(np.square(weights).sum(), rel=1e-9)
    few = replace_body(problem, hands=replace(hands, left_components=hands.left_components[:6]))
    beyond = np.square(
        np.linalg.svd(hands.left_components[:6])[2][6:] @ given["pose"][0, 21:36].flatten().numpy()
    ).sum()
    inside = np.linalg.lstsq(hands.left_components[:6].T, given["pose"][0, 21:36].flatten().numpy(), rcond=None)[0]
    expected = np.square(weights[1]).sum() + np.square(inside).sum() + beyond
    assert HandPrior(few).cost(Candidate(few, given)).item() == pytest.approx(expected, rel=1e-9)


def replace_body(problem, **changes):
    return replace(problem, body=ipt.BodyModel(replace(problem.body.body, **changes), torch.float64))


def test_jaw_prior_by_hand():
    problem, given = cases.smplx_observed(1)
    given["face"] = torch.tensor([[[0.1, 0.02, -0.03], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]], dtype=torch.float64)
    assert JawPrior(problem).cost(Candidate(problem, given)).item() == pytest.approx(0.01 + 0.04 + 0.09, rel=1e-12)
    body = Candidate(problem, given)
    assert JawPrior(problem, axes=[2, 0, 0]).cost(body).item() == pytest.approx(0.04, rel=1e-12)
    with pytest.raises(ValueError, match="jaw_prior: axes: expected three factors, got"):
        JawPrior(problem, axes=[1, 2])


def euler(x: float, y: float, z: float) -> torch.Tensor:
    """The rotation vector (1, 3) of R_z R_y R_x, degrees."""
    angles = torch.tensor([[0, 0, z], [0, y, 0], [x, 0, 0]], dtype=torch.float64).deg2rad()
    about_z, about_y, about_x = matrix(angles)
    return vector(about_z @ about_y @ about_x)[None]


# From the loss by hand, upstream's degrees: the short way round, fourth powers, 1e-4.
@pytest.mark.parametrize(
    ("shown", "turned", "expected"),
    [
        ((0, 0, 0), (0, 70, 0), 0.0),
        ((0, 0, 0), (10, 20, -5), 1e-4 * (10**4 + 5**4)),
        ((-90, 0, 0), (-80, 30, 0), 1e-4 * 10**4),
        ((170, 10, 0), (-175, -10, 0), 1e-4 * 15**4),
        ((0, 0, 175), (0, 0, -179), 1e-4 * 6**4),
        ((0, 0, 0), (180, 0, 0), 1e-4 * 180**4),
        ((0, 0, 0), (20, 90, 0), 1e-4 * 20**4),  # upstream takes z for 0 where y is a right angle
    ],
)
def test_presented_orient(shown, turned, expected):
    orient = euler(*shown)
    problem = cases.problem(1, presented=Presented(cases.zeros(1)["pose"], orient=orient))
    cost = PresentedOrient(problem).cost(cases.candidate(problem, orient=euler(*turned)))
    assert cost.item() == pytest.approx(expected, rel=1e-6, abs=1e-20)  # 180° is π but for a rounding of 1e-8


def test_presented_orient_gradients_and_rows():
    values = {**cases.variables(5), "orient": cases.variables(5, scale=1.5)["orient"]}
    shown = Presented(values["pose"], orient=cases.variables(5, seed=8, scale=1.5)["orient"])
    problem = cases.problem(5, presented=shown)
    term = PresentedOrient(problem)
    orient = values["orient"].clone().requires_grad_()
    assert torch.autograd.gradcheck(
        lambda orient: 1e-2 * term.residuals(cases.candidate(problem, orient=orient)), (orient,), check_forward_ad=True
    )
    cases.assert_rows_are_alone(PresentedOrient, problem, values)
    upright = cases.problem(1, presented=Presented(cases.zeros(1)["pose"]))
    for angles in ((0, 90, 0), (180, 0, 0), (0, 0, 0)):
        _, gradients = cases.cost_and_gradient(PresentedOrient(upright), {**cases.zeros(1), "orient": euler(*angles)})
        assert gradients["orient"].isfinite().all()
    with pytest.raises(ValueError, match="presented_orient: expected a presented pose"):
        PresentedOrient(cases.problem())


def folded(name: str) -> dict[str, torch.Tensor]:
    """A named pose, in some of which parts of the body touch: in a squat thighs and calves."""
    pose = torch.from_numpy(poses.pose(name))[None]
    return {**cases.zeros(1), "orient": pose[:, 0], "pose": pose[:, 1:]}


@pytest.mark.slow
def test_contact_normals_against_all_pairs():
    """Every sample against every other, by plain distances."""
    problem = cases.problem(1)
    template = problem.body.template
    body = cases.candidate(problem, **folded("squat"))
    vertices = body.vertices[0].numpy()
    places = template.regressor() @ vertices
    own = template.sample_faces
    first = template.faces[own][:, 0]
    far = geodesics(template, 0.3).rows(np.arange(template.num_vertices))
    corners = vertices[template.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    expected, count = 0.0, 0
    for sample in range(len(places)):
        distance = np.where(far[first[sample], first], np.linalg.norm(places - places[sample], axis=1), np.inf)
        nearest = distance.argmin()
        if distance[nearest] < 0.005:
            expected, count = expected + 1 + normals[own[sample]] @ normals[own[nearest]], count + 1
    assert count > 100
    assert ContactNormals(problem).cost(body).item() == pytest.approx(expected, rel=1e-12)
    apart = cases.candidate(problem, **cases.zeros(1))
    assert ContactNormals(problem).cost(apart).item() == 0


@pytest.mark.slow
def test_contact_normals_forget_nothing_as_a_body_moves():
    """A term that has seen a path says at its end, and on the way, what one says that sees that body first."""
    problem = cases.problem(1)
    term = ContactNormals(problem)
    squat, tree = folded("squat"), folded("tree")
    values = {name: [] for name in ("seen", "first")}
    for share in np.linspace(0, 1, 40) ** 2:
        body = {name: value + share * (tree[name] - value) for name, value in squat.items()}
        values["seen"].append(term.cost(cases.candidate(problem, **body)).item())
        values["first"].append(ContactNormals(problem).cost(cases.candidate(problem, **body)).item())
    assert values["seen"] == values["first"]
    assert len(set(values["seen"])) > 10


def test_contact_normals_gradients_and_rows():
    problem = cases.problem(1)
    term = ContactNormals(problem)
    values = folded("squat")

    def cost(pose):
        return term.cost(cases.candidate(problem, pose=pose))

    # A step of 1e-8 rad moves no sample into or out of contact, and leaves 1e-5 of the slope.
    assert torch.autograd.gradcheck(cost, (values["pose"].requires_grad_(),), fast_mode=True, eps=1e-8, atol=1e-4)
    names = ("squat", "tree", "t_pose", "chair")
    together = {block: torch.cat([folded(name)[block] for name in names]) for block in values}
    cases.assert_rows_are_alone(ContactNormals, cases.problem(4), together)
    broken = folded("squat")
    broken["pose"] = broken["pose"] * torch.nan
    assert term.cost(cases.candidate(problem, **broken)).isnan().all()


@pytest.mark.slow
def test_a_fit_starts_where_its_preset_says():
    problem, _ = cases.smplx_observed(2)
    _, begun = start.initial_state(problem, config.load("ipman-o-star").start)
    term = PosePrior(problem)
    assert term.cost(Candidate(problem, begun)).abs().max() < 1e-20  # the prior's own mean
    assert not begun["betas"].any()
    assert not begun["expression"].any()
    assert torch.equal(begun["face"], torch.zeros(2, 3, 3, dtype=torch.float64))
    for row in range(2):
        _, alone = start.initial_state(problem.rows(torch.tensor([row])), {"search": "mean", "yaws": 2})
        assert all(torch.equal(alone[name][0], value[row]) for name, value in begun.items())
    named = start.initial_state(problem, {"search": "body", "yaws": 4})[1]
    expected = start.before_camera(problem)
    assert all(torch.equal(named[name], value) for name, value in expected.items())


def test_the_camera_s_search_lays_the_ground():
    problem, _ = cases.smplx_observed(1)
    pose = torch.from_numpy(poses.pose_of(problem.body.body, "kneeling"))[None]
    problem = replace(problem, presented=Presented(pose[:, 1:], orient=pose[:, 0]))
    known, begun = start.initial_state(problem, {"search": "camera", "yaws": 2, "iterations": 2})
    lowest = Candidate(known, begun).vertices[..., 1].amin()
    assert known.ground.height.item() == pytest.approx(lowest.item(), abs=1e-12)
    assert torch.equal(variables.full_pose(begun, problem.body.body), pose)


@pytest.mark.parametrize("preset", ["smplify-x", "ipman-o-star", "smplify-xmc", "ipman-o", "fast", "balanced"])
def test_presets_fit_a_body_with_fingers_and_a_face(preset):
    problem, given = cases.smplx_observed(1)
    shown = torch.cat([given["orient"][:, None] * 0, given["pose"][:, :21], given["pose"][:, :3] * 0], dim=1)
    shown = torch.cat([shown, given["pose"][:, 21:]], dim=1)
    known = {"presented": Presented(shown[:, 1:]), "height": torch.tensor([1.7]).double()}
    problem = replace(problem, **known) if preset in ("smplify-xmc", "ipman-o", "balanced") else problem
    loaded = config.load(preset)
    stages = [replace(stage, options=replace(stage.options, iterations=3)) for stage in loaded.stages]
    loaded = replace(loaded, stages=tuple(stages))
    problem, begun = start.initial_state(problem, {**loaded.start, "iterations": 2})
    found = fit(problem, begun, loaded)
    (body,) = fit_results(found, loaded, begun)
    assert body.finite
    moves = preset in ("smplify-x", "ipman-o-star")
    for name in ("face", "expression"):
        assert bool((found.variables[name] != begun[name]).any()) == moves
    arrays = body.arrays()
    pose = np.zeros((55, 3))
    pieces = {"global_orient": [0], "body_pose": range(1, 22), "jaw_pose": [22], "leye_pose": [23], "reye_pose": [24]}
    pieces |= {"left_hand_pose": range(25, 40), "right_hand_pose": range(40, 55)}
    for name, rows in pieces.items():
        pose[list(rows)] = arrays[name].reshape(-1, 3)
    again = problem.body.body(pose, arrays["betas"][0], arrays["transl"][0], arrays["expression"][0])
    np.testing.assert_allclose(again.vertices, body.candidate.vertices[0].numpy(), atol=1e-12)
    assert ("before_expression" in arrays) == (preset not in ("smplify-x", "smplify-xmc"))


def test_bodies_without_a_face_have_no_expression():
    problem, given = cases.observed(1)
    landmarks = Landmarks(cases.body_model())
    assert landmarks.names == problem.landmarks.names
    assert set(parameters(cases.body_model().body, given)) == {"global_orient", "body_pose", "betas", "transl"}
