"""The compiled engine, as rust/py exports it; tests/test_stubs.py compares the two.

Arrays are C-contiguous. The vertices' dtype, float32 or float64, is that of every other array of the call except
`normal` (B, 3) and `height` (B,), and of its results. Functions release the GIL, answer Ctrl-C, and raise ValueError
for numbers that do not fit, TypeError for arrays of another type.
"""

from collections.abc import Sequence
from typing import Any, TypeVar, final

import numpy as np
from numpy.typing import NDArray

__version__: str

ANALYSIS_COLUMNS: dict[str, int]
"""Name and first column of each result in the rows of `analysis`: points take three columns, `inertia` nine,
`part_volumes` one per part, all others one."""

GRAVITY: float
"""m/s²"""

TERMS: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]]
"""The terms that a loss may be made of, in their order: the names of the numbers, of the modes and of the options."""

_Float = TypeVar("_Float", np.float32, np.float64)

@final
class Template:
    """Topology, closing and samples of one body surface, computed once."""

    def __new__(
        cls,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        face_parts: NDArray[np.int64],
        num_samples: int,
        seed: int,
    ) -> Template:
        """vertices (V, 3), faces (F, 3), face_parts (F,) or empty for one part."""

    @property
    def num_vertices(self) -> int: ...
    @property
    def num_parts(self) -> int: ...
    @property
    def num_samples(self) -> int: ...
    @property
    def watertight(self) -> bool: ...
    @property
    def sample_faces(self) -> NDArray[np.int64]:
        """The face of each sample, (S,), ascending."""

    @property
    def sample_parts(self) -> NDArray[np.int64]:
        """The part of each sample, (S,)."""

    @property
    def sample_barycentric(self) -> NDArray[np.float64]:
        """The weights of each sample on its face's vertices, (S, 3)."""

@final
class Quantity:
    """A quantity of one template. Its name and its options are read and checked here, once."""

    def __new__(cls, template: Template, name: str, options: Sequence[float]) -> Quantity:
        """A quantity by its name and its options in their order; `ipman_rs.quantities` makes both."""

    @property
    def num_outputs(self) -> int:
        """K: how many numbers the quantity has for one body."""

    def value(
        self, vertices: NDArray[_Float], normal: NDArray[np.float64], height: NDArray[np.float64]
    ) -> NDArray[_Float]:
        """The quantity of each body: vertices (B, V, 3) -> (B, K)."""

    def vjp(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        d_out: NDArray[_Float],
    ) -> NDArray[_Float]:
        """The gradient of Σ d_out · value by the vertices: d_out (B, K) -> (B, V, 3)."""

    def jvp(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        d_vertices: NDArray[_Float],
    ) -> NDArray[_Float]:
        """The derivative of the value along d_vertices: (B, V, 3) -> (B, K)."""

    def hvp(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        d_out: NDArray[_Float],
        d_vertices: NDArray[_Float],
    ) -> NDArray[_Float]:
        """The derivative of vjp(d_out) along d_vertices, a Hessian-vector product: (B, V, 3)."""

    def value_and_vjp(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        d_out: NDArray[_Float],
    ) -> tuple[NDArray[_Float], NDArray[_Float]]:
        """The value (B, K) and the gradient of Σ d_out · value (B, V, 3), in one pass."""

    def weighted(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        weights: Sequence[float],
        valid: NDArray[np.bool_] | None,
        reduction: str,
    ) -> tuple[NDArray[_Float], NDArray[_Float], NDArray[_Float], NDArray[_Float]]:
        """(totals, terms, shares, gradient): Σ weight · value, one number or (B,) where the reduction is "none"; the
        unweighted values (K,) or (B, K); what each body counts for (B,); the gradient of the totals' sum (B, V, 3).
        """

    def terms(
        self,
        vertices: NDArray[_Float],
        normal: NDArray[np.float64],
        height: NDArray[np.float64],
        valid: NDArray[np.bool_] | None,
        reduction: str,
    ) -> tuple[NDArray[_Float], NDArray[_Float], NDArray[_Float]]:
        """(terms, shares, jacobian) of loss terms: the first two as in `weighted`; for each body the gradients of its
        numbers one after the other, V·3 numbers by the vertices, or V by their heights: (B, J).
        """

    def terms_backward(
        self,
        jacobian: NDArray[_Float],
        shares: NDArray[_Float],
        d_terms: NDArray[_Float],
        normal: NDArray[np.float64],
    ) -> NDArray[_Float]:
        """The gradient (B, V, 3) of what `terms` gave, for its terms' upstream d_terms, (K,) or (B, K)."""

@final
class Collision:
    """All that is known of a template's collisions before a pose."""

    def __new__(cls, template: Template, vertices: NDArray[np.float64], geodesic: float) -> Collision:
        """The rest shape (V, 3) of a template; surface within `geodesic` metres of a vertex is not opposite to it."""

    def windings(self, vertices: NDArray[_Float]) -> NDArray[_Float]:
        """The winding number of each body at its vertices: (B, V, 3) -> (B, V)."""

    def depths(self, vertices: NDArray[_Float]) -> NDArray[_Float]:
        """How deep each vertex is inside another part of its body, m, 0 outside: (B, V, 3) -> (B, V)."""

    def distances(self, vertices: NDArray[_Float], near: float) -> NDArray[_Float]:
        """Distance to the nearest opposite surface, m, negative inside another part, infinite from `near` on: (B, V, 3)
        -> (B, V)."""

    def self_contact(
        self, vertices: NDArray[_Float], options: Sequence[float]
    ) -> tuple[NDArray[_Float], NDArray[_Float]]:
        """push and pull (B, 2), their gradients (B, 2, V, 3). options: push_width, pull_width, pull_weight, near."""

# Pose (n, J, 3 or 6), betas (n, k), expression (n, k) and translation (n, 3), or directions or gradients of these, in
# the skin's dtype; n is the batch, or 1 where all bodies share a parameter. None: not given, or not asked for.
_Parameters = tuple[NDArray[Any] | None, NDArray[Any] | None, NDArray[Any] | None, NDArray[Any] | None]

@final
class Skin:
    """A body model ready for skinning, in one of the two precisions."""

    def __new__(
        cls,
        v_template: NDArray[np.float64],
        shapedirs: NDArray[np.float64],
        expressiondirs: NDArray[np.float64],
        posedirs: NDArray[np.float64],
        joints: NDArray[np.float64],
        joint_shapes: NDArray[np.float64],
        joint_expressions: NDArray[np.float64],
        rest_rotation: NDArray[np.float64],
        pose_mean: NDArray[np.float64],
        weights: NDArray[np.float64],
        parents: NDArray[np.int64],
        single: bool,
    ) -> Skin:
        """Shapes as in `ipman_rs.body.BodyModel`; posedirs may be empty. `single` keeps the large arrays in float32."""

    def forward(self, batch: int, parameters: _Parameters, vertices: NDArray[Any], joints: NDArray[Any]) -> None:
        """Fills vertices (batch, V, 3) and joints (batch, J, 3)."""

    def vjp(
        self,
        batch: int,
        parameters: _Parameters,
        d_vertices: NDArray[Any] | None,
        d_joints: NDArray[Any] | None,
        gradients: _Parameters,
    ) -> None:
        """Fills the gradients by the parameters that are asked for, given those by vertices and joints (None: zero)."""

    def jvp(
        self,
        batch: int,
        parameters: _Parameters,
        along: _Parameters,
        vertices: NDArray[Any],
        joints: NDArray[Any],
    ) -> None:
        """Fills vertices and joints with their derivatives along a direction of the parameters."""

    def jacobian(self, batch: int, parameters: _Parameters, jacobian: NDArray[np.floating]) -> None:
        """Fills the derivatives (batch, P, V + J, 3) of vertices and joints by pose and betas, P of them."""

    def vjp_jvp(
        self,
        batch: int,
        parameters: _Parameters,
        d_vertices: NDArray[Any] | None,
        d_joints: NDArray[Any] | None,
        along: _Parameters,
        gradients: _Parameters,
    ) -> None:
        """Fills the gradients' derivatives along a direction of the parameters."""

def analysis(
    template: Template,
    method: str,
    contact_rule: str,
    options: Sequence[float],
    densities: Sequence[float],
    vertices: NDArray[_Float],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> tuple[NDArray[_Float], NDArray[np.float64], NDArray[np.int64]]:
    """Rows of results (B, K), by ANALYSIS_COLUMNS; corners (N, 3) of all bases of support; how many each has (B,)."""

def base_of_support(
    template: Template,
    contact_rule: str,
    method_name: str,
    threshold: float,
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """The corners (N, 3) of all polygons, and how many each has; areas, margins and numbers of contacts; (B,) each."""

def bose_lp(
    template: Template,
    contact_rule: str,
    method_name: str,
    threshold: float,
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """BoSE by the paper's linear programme, (B,)."""

def status(
    template: Template,
    contact_rule: str,
    threshold: float,
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> NDArray[np.int64]:
    """The bits of ipman_rs.Status for each body, (B,)."""

def get_num_threads() -> int:
    """The number of threads that batches use."""

def set_num_threads(threads: int | None) -> None:
    """Sets the number of threads that batches use, 1 to 1024.

    None: as RAYON_NUM_THREADS says, else as many as torch once ipman_rs.torch has been used, else one a core.
    """

def follow_threads(threads: int) -> None:
    """Uses as many threads as torch, unless `set_num_threads` or RAYON_NUM_THREADS say otherwise."""

def simd_levels() -> list[str]:
    """The CPU levels that this machine has, best first."""

def simd_level() -> str:
    """The CPU level that batches run on: avx512, avx2, neon or scalar. IPMAN_SIMD forces one."""

def solids(
    template: Template,
    densities: Sequence[float],
    contact: float,
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Each body as one solid, (B, 15): status, mass, centre, inertia row by row, height of the lowest vertex."""

def tip_test(
    template: Template,
    densities: Sequence[float],
    options: Sequence[float],
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The tip test, (B, 26): the solid's 15; height, margin, barrier, push, rate; tilt, drop, nudged tilt; at rest the
    margin, barrier and push. options: contact, tolerance, nudge, fallen.
    """

def touching(
    template: Template,
    shape_name: str,
    resolution: int,
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The points (N, 3) of all bodies that can touch a plane, and how many each has (B,).

    None for a body that is no solid, or has no hull.
    """

def simulate(
    template: Template,
    shape_name: str,
    resolution: int,
    densities: Sequence[float],
    contact: float,
    snap: bool,
    step: float,
    friction: float,
    looks: Sequence[int],
    vertices: NDArray[Any],
    normal: NDArray[np.float64],
    height: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """status (B,), and places (B, 1 + T, 12) at the start and at each look: centre of mass, rotation row by row."""
