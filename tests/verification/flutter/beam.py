"""Linear stability of a clamped–free sheet in an axial stream, solved by itself: nothing here is
the simulator's.

A strip of length L, clamped at x = 0 and free at L, with mass m and flexural rigidity B (1 + d ∂t)
per width, pulled towards its end by a weight g and by the friction c U of the stream, and loaded by
air of mass M per area in a stream U:

    m w_tt + B (1 + d ∂t) w_xxxx − g ((L − x) w_x)_x − c U (L − x) w_xx + M (∂t + U ∂x)² w = 0
    w = w_x = 0 at x = 0,                               w_xx = w_xxx = 0 at x = L

(a weight keeps its direction, friction turns with the sheet, so that the slope of its tension cancels). It is the
equation of a cantilevered pipe that conveys fluid (Gregory and Païdoussis, Proc. R. Soc. A 293:512, 1966), with
u = U L √(M/B) and β = M/(m + M); at β = 0 that of Beck's column under a follower load u² B/L².

Multiplied by a test function and integrated, with w = Σ q_j ξ² P_j(2ξ − 1), ξ = x/L and Legendre's
polynomials P_j (a Galerkin method; the conditions at the free end are natural), it is M₂ q̈ + M₁ q̇
+ M₀ q = 0: a matrix eigenproblem.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.optimize import brentq

from flagdata.core.arrays import FloatArray

TERMS = 14
_NO_FLUID = 1e-12


@dataclass(frozen=True, kw_only=True)
class Strip:
    """The sheet and its stream, per area and per width, in any consistent units.

    Attributes:
        length: L.
        mass: m of the sheet.
        rigidity: B.
        air_mass: M of the air that moves with it.
        speed: U.
        damping: d, a time.
        weight: g, per area.
        friction: c, both sides together: force per area and speed.
        lag: τ by which the Coriolis load 2 M U w_xt is late, to first order: 2 M U (w_xt − τ
            w_xtt).
    """

    length: float = 1.0
    mass: float = 1.0
    rigidity: float = 1.0
    air_mass: float = 0.0
    speed: float = 0.0
    damping: float = 0.0
    weight: float = 0.0
    friction: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Onset:
    """Where the straight sheet loses its stability: the speed, and the angular frequency there."""

    speed: float
    frequency: float


def pipe(*, beta: float, gravity: float = 0.0, damping: float = 0.0) -> Strip:
    """The strip whose numbers are those of the literature on pipes: time in L² √((m + M)/B), speed
    u/√β.

    Args:
        beta: M/(m + M); 0 stands for so light and fast a fluid that only its thrust is left.
        gravity: γ = (m + M) g L³/B, hanging.
        damping: d, of Kelvin and Voigt.
    """
    light = max(beta, _NO_FLUID)
    return Strip(mass=1 - light, air_mass=light, damping=damping, weight=gravity)


@functools.cache
def _integrals(terms: int) -> dict[str, FloatArray]:
    """∫ f_i g_j dξ of the basis and its derivatives, exact by Gauss quadrature: (terms, terms)
    each."""
    nodes, weights = legendre.leggauss(terms + 4)
    xi, weight = (nodes + 1) / 2, weights / 2
    p, p1, p2 = (
        2**k * legendre.legval(nodes, legendre.legder(np.eye(terms), k) if k else np.eye(terms))
        for k in range(3)
    )
    f, f1, f2 = xi**2 * p, 2 * xi * p + xi**2 * p1, 2 * p + 4 * xi * p1 + xi**2 * p2
    return {
        "00": (f * weight) @ f.T,
        "01": (f * weight) @ f1.T,
        "02": (f * weight) @ f2.T,
        "11 (1 − ξ)": (f1 * weight * (1 - xi)) @ f1.T,
        "02 (1 − ξ)": (f * weight * (1 - xi)) @ f2.T,
        "22": (f2 * weight) @ f2.T,
    }


def eigenvalues(strip: Strip, *, terms: int = TERMS) -> NDArray[np.complex128]:
    """(2 terms,) rates s of w ∝ exp(s t), those with positive imaginary part first, by rising
    frequency."""
    part = _integrals(terms)
    length, air, speed = strip.length, strip.air_mass, strip.speed
    total = strip.mass + air
    unit = np.sqrt(total / strip.rigidity) * length**2  # of time
    thrust = air * speed**2 * part["02"]
    tension = strip.weight * part["11 (1 − ξ)"] - strip.friction * speed * part["02 (1 − ξ)"]
    zeroth = part["22"] + (thrust + length * tension) * length**2 / strip.rigidity
    first = (
        strip.damping / unit * part["22"] + 2 * air * speed * unit / (total * length) * part["01"]
    )
    second = part["00"] - 2 * air * speed * strip.lag / (total * length) * part["01"]
    flow = np.linalg.solve(second, np.hstack([zeroth, first]))
    matrix = np.block([[np.zeros((terms, terms)), np.eye(terms)], [-flow]])
    values = np.linalg.eigvals(matrix) / unit
    return values[np.lexsort([values.imag, values.imag <= 0])].astype(np.complex128)


def leading(strip: Strip, *, terms: int = TERMS) -> complex:
    """The rate that grows fastest or decays slowest; of a pair the one with positive imaginary
    part."""
    values = eigenvalues(strip, terms=terms)
    value = complex(values[np.argmax(values.real)])
    return complex(value.real, abs(value.imag))


def onset(
    strip: Strip, *, lowest: float = 0.0, highest: float, samples: int = 100, terms: int = TERMS
) -> Onset:
    """The lowest speed above `lowest` at which a mode stops decaying.

    Raises:
        ValueError: none does up to `highest`.
    """

    def growth(speed: float) -> float:
        return leading(replace(strip, speed=speed), terms=terms).real

    speeds = np.linspace(lowest, highest, samples + 1)[1:]
    for low, high in itertools.pairwise(speeds):
        if growth(high) > 0:
            speed = float(brentq(growth, low, high, rtol=1e-10))
            return Onset(
                speed=speed, frequency=leading(replace(strip, speed=speed), terms=terms).imag
            )
    raise ValueError(f"no flutter up to a speed of {highest:g}")


def pipe_onset(
    *, beta: float, gravity: float = 0.0, damping: float = 0.0, terms: int = TERMS
) -> Onset:
    """u and ω L² √((m + M)/B) at the onset."""
    strip = pipe(beta=beta, gravity=gravity, damping=damping)
    root = float(np.sqrt(strip.air_mass))
    found = onset(strip, lowest=2 / root, highest=25 / root, terms=terms)
    return Onset(speed=found.speed * root, frequency=found.frequency)
