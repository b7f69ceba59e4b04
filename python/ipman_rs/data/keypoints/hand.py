"""The 21 points of a hand, in the order that OpenPose and COCO-WholeBody share."""

from __future__ import annotations


def hand(side: str) -> tuple[str | None, ...]:
    """Their landmarks; the wrist is left to the body's own."""
    fingers = ("thumb", "index", "middle", "ring", "pinky")
    return (None, *(f"{side}_{finger}{end}" for finger in fingers for end in ("1", "2", "3", "_tip")))
