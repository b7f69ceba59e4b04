"""What numpy users pass, turned into what the core takes: bodies (B, V, 3) and their grounds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ipman_rs.checks import body_template, real_array, single_or_double

if TYPE_CHECKING:
    from ipman_rs.ground import Ground
    from ipman_rs.quantities import Quantity
    from ipman_rs.template import BodyTemplate


def of_each(rows: NDArray[Any], counts: NDArray[np.int64]) -> list[NDArray[Any]]:
    """The rows of each body, of all bodies' rows one after the other and how many each has."""
    return [rows[end - count : end] for count, end in zip(counts, np.cumsum(counts), strict=True)]


class Bodies:
    """A batch of posed bodies of one template: `vertices` (B, V, 3) and the free batch `shape` that B stands for."""

    def __init__(self, vertices: ArrayLike, template: BodyTemplate) -> None:
        body_template(template)
        array = real_array("vertices", vertices)
        expected = (template.num_vertices, 3)
        if array.ndim < 2 or array.shape[-2:] != expected:
            hint = "; the last two axes look swapped" if array.shape[-2:] == expected[::-1] else ""
            raise ValueError(f"vertices: expected (..., {expected[0]}, 3) for this template, got {array.shape}{hint}")
        self.template = template
        self.shape = array.shape[:-2]
        self.vertices = single_or_double(array.reshape((-1, *expected) if array.size else (0, *expected)))

    def over(self, ground: Ground) -> tuple[NDArray[Any], NDArray[np.float64], NDArray[np.float64]]:
        """The arguments that every entry of the core takes: vertices, normals (B, 3) and heights (B,)."""
        if not hasattr(ground, "signed_height"):
            raise TypeError(f"ground: expected ipman_rs.Ground, got {type(ground).__name__}")
        try:
            normal = np.broadcast_to(ground.normal, (*self.shape, 3))
            height = np.broadcast_to(ground.height, self.shape)
        except ValueError:
            raise ValueError(
                f"ground: normal {ground.normal.shape} and height {ground.height.shape} do not fit "
                f"a batch of shape {self.shape}; pass one ground, or one for each body"
            ) from None
        batch = len(self.vertices)
        return self.vertices, normal.reshape(batch, 3).copy(), height.reshape(batch).copy()

    def evaluate(self, quantity: Quantity, ground: Ground) -> NDArray[Any]:
        """The quantity of each body, (..., *quantity.shape)."""
        rows = quantity.of(self.template).value(*self.over(ground))
        return rows.reshape((*self.shape, *quantity.shape))[()]

    def unfold(self, rows: NDArray[Any], *shape: int) -> Any:
        """Rows (B, …) as (..., *shape); a plain number where that is no dimension at all."""
        return rows.reshape((*self.shape, *shape))[()]
