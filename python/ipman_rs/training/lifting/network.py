"""HMR's regressor on keypoints in place of an image."""

from __future__ import annotations

import torch

from ipman_rs.body import load_body

from ...synthetic.population import BODY
from ..model import HMR, MeanParameters
from ..model.keypoint_encoder import WIDTH, KeypointEncoder


def lifting_network(seed: int, body: str = BODY, width: int = WIDTH, blocks: int = 1) -> HMR:
    """A regressor of an embedded body with the weights that a seed draws."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        encoder = KeypointEncoder(width=width, blocks=blocks)
        return HMR(encoder, width, MeanParameters.of(load_body(body)), hidden=WIDTH, dropout=0.0)
