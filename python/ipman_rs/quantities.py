"""From the arguments of a public function to a quantity: its name, its checked options, the shape of its output.

The numpy and the torch function of a quantity share one function here. The names are those of the core, where
rust/core/src/registry.rs lists them.

Raises (all functions):
    ValueError: an option is out of its range, or no such word; the message names it and what was expected.
    TypeError: an option is no number, or `template` is no template.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ipman_rs import _core
from ipman_rs.checks import LARGEST, SMALLEST, body_template, choice, not_negative, number, positive, real_array

if TYPE_CHECKING:
    from ipman_rs.presets import Preset
    from ipman_rs.template import BodyTemplate

Method = Literal["pcom", "vertex_mean", "sample_mean", "face_area", "exact"]
Points = Literal["samples", "vertices"]
Curve = Literal["tanh_squared", "tanh_of_square"]
Wrap = Literal["log", "saturate", "none"]
Contact = Literal["paper", "released"]

MOST_HANDLES = 64  # of one template; without a bound, a sweep over an option would fill the memory


class Quantity(NamedTuple):
    """What to compute of each body.

    name: such as "stability_loss"; modes: the words that choose its variant, such as ("pcom",).
    options: its numbers, in the order of the core.
    shape: of the output for one body, () for a plain number.
    """

    name: str
    modes: tuple[str, ...] = ()
    options: tuple[float, ...] = ()
    shape: tuple[int, ...] = ()

    @property
    def full_name(self) -> str:
        """The core's name, such as "stability_loss.pcom"."""
        return ".".join((self.name, *self.modes))

    def of(self, template: BodyTemplate) -> _core.Quantity:
        """The core's object, which computes it for bodies of a template; the template keeps the latest few."""
        handles = template._quantities
        handle = handles.get(self)
        if handle is None:
            handle = _core.Quantity(template._core, self.full_name, self.options)
            if len(handles) >= MOST_HANDLES:
                handles.clear()
            handles[self] = handle
        return handle


def part_volumes(template: BodyTemplate) -> Quantity:
    return Quantity("part_volumes", shape=(body_template(template).num_parts,))


def mass_properties(density: ArrayLike, template: BodyTemplate) -> Quantity:
    return Quantity("mass_properties", (), tuple(densities(density, template)), (1 + template.num_parts, 14))


def densities(density: ArrayLike, template: BodyTemplate) -> list[float]:
    """One density, or one per part, kg/m³."""
    body_template(template)
    with np.errstate(over="ignore"):
        values = real_array("density", density).astype(np.float64)
    if values.shape not in {(), (1,), (template.num_parts,)}:
        raise ValueError(f"density: expected one number or ({template.num_parts},), got {values.shape}")
    if not ((values >= SMALLEST).all() and (values <= LARGEST).all()):
        raise ValueError("density: expected positive kg/m³")
    return [float(value) for value in values.reshape(-1)]


def sample_surface(template: BodyTemplate) -> Quantity:
    return Quantity("sample_surface", shape=(body_template(template).num_samples, 3))


def center_of_mass(method: Method) -> Quantity:
    return Quantity("center_of_mass", (choice("method", method, Method),), shape=(3,))


def pressure(alpha: float, gamma: float, template: BodyTemplate) -> Quantity:
    options = not_negative("alpha", alpha), not_negative("gamma", gamma)
    return Quantity("pressure", (), options, (body_template(template).num_samples,))


def center_of_pressure(alpha: float, gamma: float, epsilon: float) -> Quantity:
    options = not_negative("alpha", alpha), not_negative("gamma", gamma), not_negative("epsilon", epsilon)
    return Quantity("center_of_pressure", (), options, (3,))


def support_margin(threshold: float, method: Method, contact: Contact) -> Quantity:
    rule, center, metres = support(threshold, method, contact)
    return Quantity("support_margin", (rule, center), (metres,))


def support(threshold: float, method: Method, contact: Contact, name: str = "method") -> tuple[str, str, float]:
    """Rule of contact, centre of mass and threshold of a base of support; `name`: of the argument that is `method`."""
    return choice("contact", contact, Contact), choice(name, method, Method), positive("threshold", threshold)


def stability_loss(alpha: float, gamma: float, epsilon: float, method: Method) -> Quantity:
    options = center_of_pressure(alpha, gamma, epsilon).options
    return Quantity("stability_loss", (choice("method", method, Method),), options)


def ground_loss(alpha1: float, alpha2: float, beta1: float, beta2: float, points: Points, curve: Curve) -> Quantity:
    """Pull and push."""
    pull = not_negative("alpha1", alpha1), positive("alpha2", alpha2)
    push = not_negative("beta1", beta1), positive("beta2", beta2)
    modes = choice("points", points, Points), choice("curve", curve, Curve)
    return Quantity("ground_loss", modes, pull + push, (2,))


def balance_cost(alpha: float, gamma: float, sigma: float, wrap: Wrap, method: Method) -> Quantity:
    options = not_negative("alpha", alpha), not_negative("gamma", gamma), positive("sigma", sigma)
    return Quantity("balance_cost", (choice("wrap", wrap, Wrap), choice("method", method, Method)), options)


class Term(NamedTuple):
    """A term that `IntuitivePhysicsLoss` may have.

    numbers: their names, such as ("pull", "push"); each has a weight.
    modes: the arguments that choose its variant; options: its constants, by their names in a preset.
    """

    numbers: tuple[str, ...]
    modes: tuple[str, ...]
    options: tuple[str, ...]


TERMS = {name: Term(*described) for name, described in _core.TERMS.items()}
MODES = {"method": Method, "points": Points, "curve": Curve, "wrap": Wrap}
PAPER_TERMS = ("stability", "ground")  # Eqs. 4 and 5


def numbers_of(terms: Iterable[str]) -> tuple[str, ...]:
    """The names of the numbers of terms, in their order."""
    return tuple(number for term in terms for number in TERMS[term].numbers)


def terms_of(preset: Preset) -> tuple[str, ...]:
    """The terms that a preset has weights for.

    Raises:
        ValueError: a weight is of no term, or a number of a term has none.
    """
    terms = tuple(name for name, term in TERMS.items() if set(term.numbers) & set(preset.weights))
    if set(numbers_of(terms)) != set(preset.weights) or not terms:
        known = ", ".join(" and ".join(term.numbers) for term in TERMS.values())
        raise ValueError(f"weights of preset {preset.name!r}: expected {known}, got {', '.join(preset.weights)}")
    return terms


def physics_terms(preset: Preset, method: Method, points: Points, curve: Curve, wrap: Wrap) -> Quantity:
    """The terms of a preset together: their numbers side by side."""
    given = {"method": method, "points": points, "curve": curve, "wrap": wrap}
    terms = terms_of(preset)
    words: list[str] = []
    options: list[float] = []
    for name in terms:
        term = TERMS[name]
        words += [name, *(choice(mode, given[mode], MODES[mode]) for mode in term.modes)]
        options += [number(option, getattr(preset, option)) for option in term.options]
    return Quantity("terms", tuple(words), tuple(options), (len(numbers_of(terms)),))


def is_paper_terms(quantity: Quantity) -> bool:
    """Whether these are `physics_terms` with the paper's terms, centre of mass and points; the curve may be any."""
    return quantity.name == "terms" and quantity.modes[:-1] == ("stability", "pcom", "ground", "samples")
