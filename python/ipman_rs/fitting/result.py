"""One fitted body out of a batch: its parameters as plain arrays, how its fit went, and how far it is to be trusted."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ipman_rs.body import pose_arrays
from ipman_rs.body.model import BodyModel
from ipman_rs.jsonable import jsonable
from ipman_rs.renamed import old_names

from . import confidence
from .candidate import Candidate
from .confidence import Confidence
from .config import FitConfig
from .fit import Fit, StageReport
from .hypotheses import Hypothesis
from .solvers.outcome import CONVERGED
from .start import SEEN
from .terms import PHYSICS
from .variables import BLOCKS, Variables, full_pose

Arrays = dict[str, NDArray[Any]]

OFF = 0.05  # m: a body whose lowest point is further from the floor is flagged
FAR = 99.0  # m from the camera: where the start gives up


@dataclass(frozen=True)
class FitResult:
    """One fitted body, a candidate of one row; its variables before the physics terms (None: no stage has any); and how
    each stage went, as plain values. weighed: its hypotheses, the cheapest first; runner_up: the body of the second.
    """

    candidate: Candidate
    before: Variables | None
    stages: list[dict[str, Any]]
    converged: bool
    weighed: list[Hypothesis] | None = None
    runner_up: Candidate | None = None

    @property
    def finite(self) -> bool:
        return all(bool(self.candidate.variables[name].isfinite().all()) for name in BLOCKS)

    def arrays(self) -> Arrays:
        """What a parameter file holds, each with a leading axis of 1, but for names:

        global_orient (1, 3), body_pose (1, 3n), betas (1, b), transl (1, 3) and hands, jaw, eyes and expression where
        the body has them; camera_rotation (1, 3, 3), camera_translation (1, 3), focal (1, 2), center (1, 2), image_size
        (1, 2); ground_normal (1, 3), ground_height (1,); keypoints (1, K, 3), projected (1, K, 2), keypoint_names (K,);
        model (). Parameters before the physics terms are named before_global_orient and so on.
        """
        problem, camera, body = self.candidate.problem, self.candidate.camera, self.candidate.problem.body.body
        arrays = parameters(body, self.candidate.variables)
        if self.before is not None:
            arrays |= {f"before_{name}": value for name, value in parameters(body, self.before).items()}
        arrays |= {
            "camera_rotation": _array(camera.rotation),
            "camera_translation": _array(camera.translation),
            "focal": _array(camera.focal),
            "center": _array(camera.center),
            "projected": _array(self.candidate.projected),
            "keypoint_names": np.array(problem.landmarks.names),
            "model": np.array(body.name),
        }
        if problem.image_size is not None:
            arrays["image_size"] = _array(problem.image_size)
        if problem.points is not None and problem.confidence is not None:
            arrays["keypoints"] = _array(torch.cat([problem.points, problem.confidence[..., None]], dim=-1))
        if problem.ground is not None:
            arrays["ground_normal"] = _array(problem.ground.normal.reshape(1, 3))
            arrays["ground_height"] = _array(problem.ground.height.reshape(1))
        return arrays

    def record(self) -> dict[str, Any]:
        """How the fit went: plain values for JSON. The reason is the last stage's that did not converge, if any."""
        late = [stage for stage in self.stages if stage["reason"] not in CONVERGED] or self.stages
        return {
            "converged": self.converged,
            "reason": late[-1]["reason"],
            "iterations": sum(stage["iterations"] for stage in self.stages),
            "reprojection": jsonable(self.reprojection()),
            "stages": self.stages,
            "confidence": jsonable(self.confidence.record()),
            **({} if self.weighed is None else {"hypotheses": [jsonable(asdict(each)) for each in self.weighed]}),
        }

    @cached_property
    def confidence(self) -> Confidence:
        """How sure this body is, and why not."""
        return confidence.assess(
            self.candidate, self.reprojection().get("median_percent", 0.0), self.weighed, self.runner_up
        )

    def reprojection(self) -> dict[str, float]:
        """Errors of the points that were seen: their median in pixels, and in percent of the height of the whole fitted
        body in the image."""
        problem = self.candidate.problem
        if problem.points is None or problem.confidence is None:
            return {}
        with torch.no_grad():
            errors = (self.candidate.projected - problem.points).norm(dim=-1)[problem.confidence > SEEN]
            image = self.candidate.camera.project(self.candidate.vertices.double())[0]
        tall = max(float(image[:, 1].max() - image[:, 1].min()), 1e-9)
        median = float(errors.median()) if len(errors) else float("nan")
        return {"median_px": median, "median_percent": 100 * median / tall, "height_px": tall}

    def flags(self) -> list[str]:
        """Why this body should be looked at before it is used."""
        flags = list(self.confidence.reasons)
        with torch.no_grad():
            vertices = self.candidate.vertices.double()
            depth = float(self.candidate.camera.see(vertices)[..., 2].mean())
        if depth > FAR:
            flags.append(f"{depth:.0f} m from the camera: check the focal length")
        ground = self.candidate.problem.ground
        if ground is not None:
            height = float(ground.signed_height(vertices).min())
            if abs(height) > OFF:
                side = "above" if height > 0 else "below"
                flags.append(f"its lowest point is {abs(height):.2f} m {side} the floor")
        return flags


def fit_results(fit: Fit, config: FitConfig, start: Variables) -> list[FitResult]:
    """The bodies of a fit that began with `start`, one by one."""
    before = _before_physics(fit, config, start)
    converged = fit.converged
    return [
        FitResult(
            _candidate(fit, row),
            None if before is None else _row(before, row),
            [_stage(stage, row) for stage in fit.stages],
            bool(converged[row]),
            None if fit.weighed is None else fit.weighed[row],
            None if fit.runner_up is None else _candidate(fit.runner_up, row),
        )
        for row in range(fit.problem.num_bodies)
    ]


def _candidate(fit: Fit, row: int) -> Candidate:
    return Candidate(fit.problem.rows(torch.tensor([row])), _row(fit.variables, row))


def parameters(body: BodyModel, variables: Variables) -> Arrays:
    """SMPL's names for the pose, shape and place of bodies, and the expression where they have one, a row each."""
    pose = _array(full_pose(variables, body))
    arrays: Arrays = pose_arrays.split(pose, body)
    if body.num_expressions:
        arrays["expression"] = _array(variables["expression"])
    return {**arrays, "betas": _array(variables["betas"]), "transl": _array(variables["transl"])}


def _before_physics(fit: Fit, config: FitConfig, start: Variables) -> Variables | None:
    """Variables with which the first stage with physics terms began."""
    for number, stage in enumerate(config.stages):
        if any(stage.weights.get(term, 0) > 0 for term in PHYSICS):
            return start if number == 0 else fit.stages[number - 1].variables
    return None


def _stage(stage: StageReport, row: int) -> dict[str, Any]:
    terms = {name: jsonable(cost[row]) for name, cost in stage.terms.items()}
    record = {"name": stage.name, "reason": stage.reasons[row], "iterations": stage.iterations[row], "terms": terms}
    if stage.trace is not None:
        record["trace"] = {name: jsonable(costs) for name, costs in stage.trace[row].items()}
    return record


def _row(variables: Variables, row: int) -> dict[str, Tensor]:
    return {name: value[row : row + 1] for name, value in variables.items()}


def _array(value: Tensor) -> NDArray[Any]:
    return value.detach().numpy().copy()


__getattr__ = old_names(__name__, {"Result": "FitResult", "results": "fit_results"})
