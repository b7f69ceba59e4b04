"""Checkpoints in SPIN's format, which IPMAN-R's share: {"model": weights} of HMR with a ResNet-50.

SPIN keeps encoder and regressor in one flat module: `conv1`, `bn1`, `layer1` to `layer4`, as torchvision names them,
then `fc1`, `fc2`, `decpose`, `decshape`, `deccam`, and the mean parameters `init_pose`, `init_shape`, `init_cam`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from torch import Tensor

from .checkpoint_file import read_checkpoint
from .hmr import HMR

OF_REGRESSOR = ("fc1.", "fc2.", "decpose.", "decshape.", "deccam.", "init_")
COUNTERS = "num_batches_tracked"  # of batch normalisation; older checkpoints lack them, and nothing depends on them


def load_spin(model: HMR, path: str | os.PathLike[str]) -> None:
    """Weights and mean parameters of a checkpoint into a model with the backbone "resnet50". Nothing in the file runs.

    ValueError, naming the file: unreadable, not SPIN's format, or weights that are missing, unknown, of another shape
    or not finite.
    """
    weights = _renamed(_weights(path))
    wanted = model.state_dict()
    complaints = [
        _listed("lacks", [name for name in wanted if name not in weights and not name.endswith(COUNTERS)]),
        _listed("has the unknown", [name for name in weights if name not in wanted]),
        _listed(
            "has another shape of",
            [f"{name} {tuple(weights[name].shape)}, not {tuple(wanted[name].shape)}" for name in wanted
             if name in weights and weights[name].shape != wanted[name].shape],
        ),
        _listed("is not finite in", [name for name, value in weights.items() if not value.isfinite().all()]),
    ]  # fmt: skip
    faults = "; ".join(complaint for complaint in complaints if complaint)
    if faults:
        raise ValueError(
            f"{path}: expected SPIN's weights for HMR with a ResNet-50 and {_body(wanted)}, but it {faults}"
        )
    model.load_state_dict(weights, strict=False)


def _weights(path: str | os.PathLike[str]) -> dict[str, Tensor]:
    content = read_checkpoint(path)
    weights = content.get("model") if isinstance(content, Mapping) else None
    if not isinstance(weights, Mapping) or not all(isinstance(value, Tensor) for value in weights.values()):
        names = ", ".join(map(str, list(content)[:8])) if isinstance(content, Mapping) else type(content).__name__
        raise ValueError(f"{path}: expected a dictionary with weights under 'model', as SPIN saves it, got {names}")
    return dict(weights)


def _renamed(weights: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Weights by the names of `HMR`; `module.` is DataParallel's."""
    plain = {name.removeprefix("module."): value for name, value in weights.items()}
    return {
        f"{'regressor' if name.startswith(OF_REGRESSOR) else 'encoder'}.{name}": value for name, value in plain.items()
    }


def _listed(what: str, names: list[str]) -> str:
    return f"{what} {', '.join(names[:3])}{f' and {len(names) - 3} more' if len(names) > 3 else ''}" if names else ""


def _body(wanted: Mapping[str, Tensor]) -> str:
    joints, betas = (wanted[f"regressor.{name}"].shape[1] for name in ("init_pose", "init_shape"))
    return f"a body of {joints // 6} joints and {betas} betas"
