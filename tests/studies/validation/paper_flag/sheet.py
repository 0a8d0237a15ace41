"""Small deflections of a sheet, clamped at its leading edge, in an axial stream: growth rates and
frequencies.

Per width, with mass m, flexural rigidity B (1 + d ∂t), length L and a stream U,

    m w_tt + B (1 + d ∂t) w_xxxx + M (∂t + U ∂x)² w + M₀ w_tt + ½ ρ C U (∂t + U ∂x) w − c (τ w_x)_x = 0
    w = w_x = 0 at x = 0,                               w_xx = w_xxx = 0 at x = L

M is the air's mass of the reactive loading (`sim.effects.reactive_loading`), M₀ that of still-air
inertia alone (`sim.effects.added_mass`), C the slope of the lift coefficient (`sim.effects.lift`),
and τ = U (L − x) the tension by friction of coefficient c (`sim.effects.tangential_linear_drag`),
which turns with the sheet: its load is −c U (L − x) w_xx. The base model's air, ρ |w_n| w_n, is of
second order in the deflection and so has no part here: to first order the base model is a sheet in
a vacuum, at every speed.

Solved by Galerkin's method on the sheet's modes in a vacuum; M only, it is the equation of a pipe
that conveys fluid (Gregory and Païdoussis, Proc. R. Soc. A 293:512, 1966), and of a flag in
Argentina and Mahadevan, PNAS 102:1829 (2005), without their wake.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError

MODES = 8
_NODES = 96


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A sheet and its air, per area and width.

    Attributes:
        length: L [m].
        mass: m [kg/m²].
        rigidity: B [N m].
        reactive_mass: M [kg/m²].
        still_mass: M₀ [kg/m²].
        damping: d [s].
        lift: ½ ρ C [kg/m³].
        friction: c, both sides together [kg/(m² s)].
    """

    length: float
    mass: float
    rigidity: float
    reactive_mass: float = 0.0
    still_mass: float = 0.0
    damping: float = 0.0
    lift: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not (self.length > 0 and self.mass > 0 and self.rigidity > 0):
            raise InputError(
                "a sheet without length, mass or rigidity",
                where="sheet",
                fix="give positive values",
            )


@dataclass(frozen=True, kw_only=True)
class Leading:
    """The mode that grows fastest.

    Attributes:
        growth: [1/s], negative where every mode decays.
        frequency: [Hz].
    """

    growth: float
    frequency: float


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return cast("float", brentq(function, low, high, xtol=1e-13))


@functools.cache
def _integrals() -> dict[str, FloatArray]:
    """∫ f g dξ of the modes in a vacuum and their derivatives: (MODES, MODES) each, and the roots
    λ."""

    def characteristic(root: float) -> float:
        return float(np.cos(root) + 1 / np.cosh(root))

    middles = [np.pi * (n + 0.5) for n in range(MODES)]
    roots = np.array([_root(characteristic, middle - 0.4, middle + 0.4) for middle in middles])[
        :, None
    ]
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    xi, weight = (nodes + 1) / 2, weights / 2
    below = np.sinh(roots) + np.sin(roots)
    # cosh − σ sinh as rising and falling exponentials: their difference loses no digits at large λ.
    rising = (np.sin(roots) - np.cos(roots) - np.exp(-roots)) / below / 2
    falling = 1 - rising
    sigma = 1 - 2 * rising
    up, down = rising * np.exp(roots * xi), falling * np.exp(-roots * xi)
    sine, cosine = np.sin(roots * xi), np.cos(roots * xi)
    f = up + down - cosine + sigma * sine
    f1 = roots * (up - down + sine + sigma * cosine)
    f2 = roots**2 * (up + down + cosine - sigma * sine)
    return {
        "00": (f * weight) @ f.T,
        "01": (f * weight) @ f1.T,
        "02": (f * weight) @ f2.T,
        "02 (1 − ξ)": (f * weight * (1 - xi)) @ f2.T,
        "22": np.diag(np.square(np.square(roots[:, 0]))),
    }


def rates(sheet: Sheet, speed: float) -> NDArray[np.complex128]:
    """(2 MODES,) rates r of w ∝ exp(r t) [1/s] in a stream `speed` [m/s]."""
    part = _integrals()
    length, air = sheet.length, sheet.reactive_mass
    total = sheet.mass + air + sheet.still_mass
    unit = np.sqrt(total / sheet.rigidity) * length**2  # of time
    scale = length**2 / sheet.rigidity
    bend = part["22"]
    zeroth = (
        bend
        + air * speed**2 * scale * part["02"]
        - sheet.friction * speed * length * scale * part["02 (1 − ξ)"]
        + sheet.lift * speed**2 * length * scale * part["01"]
    )
    first = (
        sheet.damping / unit * bend
        + 2 * air * speed * unit / (total * length) * part["01"]
        + sheet.lift * speed * unit / total * part["00"]
    )
    identity = np.eye(MODES)
    matrix = np.block([[np.zeros_like(identity), identity], [-zeroth, -first]])
    return (np.linalg.eigvals(matrix) / unit).astype(np.complex128)


def leading(sheet: Sheet, speed: float) -> Leading:
    """The fastest growing mode in a stream `speed` [m/s]; without growth, the least damped one that
    oscillates."""
    found = rates(sheet, speed)
    found = found[found.imag >= 0]
    best = found[np.argmax(found.real)]
    return Leading(growth=float(best.real), frequency=float(best.imag / (2 * np.pi)))


def onset(sheet: Sheet, *, highest: float, samples: int = 120) -> float:
    """The lowest speed [m/s] at which a mode grows; NaN where none does up to `highest`."""
    # The undamped sheet in still air has Re r = 0 up to rounding.
    small = 1e-6 * abs(rates(sheet, 0.0)).min()

    def growth(speed: float) -> float:
        return leading(sheet, speed).growth - small

    speeds = np.linspace(0, highest, samples + 1)[1:]
    before = 0.0
    for speed in speeds:
        if growth(float(speed)) > 0:
            if growth(before) > 0:
                return float(speed)
            return _root(growth, before, float(speed))
        before = float(speed)
    return float("nan")
