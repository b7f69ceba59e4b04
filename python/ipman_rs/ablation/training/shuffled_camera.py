"""The negative control: physics terms that see the gravity of other images. What they gain then is not physics."""

from __future__ import annotations

import dataclasses

import torch

from ...training.batch import Batch


def shuffled_camera(batch: Batch, seed: int) -> Batch:
    """The batch with its cameras, and how their images were turned and mirrored, dealt out anew."""
    order = torch.randperm(len(batch), generator=torch.Generator().manual_seed(seed))
    return dataclasses.replace(batch, camera=batch.camera[order], turn=batch.turn[order], flip=batch.flip[order])
