"""What has been published of real flags, as bands that a prediction of the same number is laid
beside.

A band is the published value with the tolerance of the aim where the source gives one number: 30 %
of the codes' drag, 15 % of wavelength and wave speed. `role` says which numbers a model may be
fitted to and which judge it; it was fixed before any model beside the base model was fitted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from flagdata.core.arrays import FloatArray
from tests.studies.validation.real_flags.runs import AIR, HEIGHT, LENGTH, READINGS, Flag

DENSITIES = (0.284, 0.11)
SPEEDS = (2.5, 4.0, 6.0, 10.0)
FLAGS = tuple(Flag(area_weight=density, speed=speed) for density in DENSITIES for speed in SPEEDS)
STREAMING = tuple(flag for flag in FLAGS if flag.speed >= 6)
"""Those whose drag and waves are compared: the sources are about flags that stream."""
_AREA = LENGTH * HEIGHT


class Role(StrEnum):
    """What a number is used for."""

    FIT = "fit"
    JUDGE = "judge"
    NONE = "not comparable"


@dataclass(frozen=True, kw_only=True)
class Published:
    """A published number.

    Attributes:
        quantity, condition, source, sure: in words.
        role: what it is used for.
        unit: of the bands.
        bands: what it is predicted for, in words → (low, high).
        predicted: values (flag, reading) of `FLAGS` → one prediction a band; None where nothing
            here is comparable.
    """

    name: str
    quantity: str
    condition: str
    source: str
    sure: str
    role: Role
    unit: str = "1"
    bands: dict[str, tuple[float, float]]
    predicted: Callable[[FloatArray], list[float]] | None = None


def about(value: float, share: float) -> tuple[float, float]:
    """A band of a share on both sides."""
    return value * (1 - share), value * (1 + share)


def code_drag(flag: Flag, *, constant: float) -> float:
    """C_D of a free flag: constant + 0.7 (m/ρH) (LH/H²)^−1.25, as the codes have it."""
    return constant + 0.7 * flag.area_weight / (AIR * HEIGHT) * (_AREA / HEIGHT**2) ** -1.25


def label(flag: Flag) -> str:
    """A flag in words."""
    return f"{1e3 * flag.area_weight:g} g/m², {flag.speed:g} m/s"


def _each(reading: str, flags: tuple[Flag, ...]) -> Callable[[FloatArray], list[float]]:
    rows, column = [FLAGS.index(flag) for flag in flags], READINGS.index(reading)
    return lambda values: values[rows, column].tolist()


def _of(
    flags: tuple[Flag, ...], band: Callable[[Flag], tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    return {label(flag): band(flag) for flag in flags}


def _speed_of_droop(values: FloatArray) -> list[float]:
    """The wind [m/s] at which the droop is 45°, by density; the slowest simulated where it is less
    there."""
    column = READINGS.index("droop")
    found = []
    for density in DENSITIES:
        rows = [i for i, flag in enumerate(FLAGS) if flag.area_weight == density]
        droops, winds = values[rows, column], np.log(SPEEDS)
        found.append(float(np.exp(np.interp(-math.pi / 4, -droops, winds))))
    return found


def _exponents(values: FloatArray) -> list[float]:
    """n of F ∝ Uⁿ from 6 to 10 m/s, by density."""
    column = READINGS.index("drag")
    drags = [
        [values[FLAGS.index(Flag(area_weight=d, speed=u)), column] for u in (6.0, 10.0)]
        for d in DENSITIES
    ]
    return [2 + math.log(fast / slow) / math.log(10 / 6) for slow, fast in drags]


def _amplitude_exponents(values: FloatArray) -> list[float]:
    """n of amplitude ∝ mⁿ, by wind."""
    column = READINGS.index("amplitude")
    heavy, light = DENSITIES
    sizes = [
        [values[FLAGS.index(Flag(area_weight=d, speed=u)), column] for d in DENSITIES]
        for u in (6.0, 10.0)
    ]
    return [math.log(a / b) / math.log(heavy / light) for a, b in sizes]


_BY_DENSITY = [f"{1e3 * density:g} g/m²" for density in DENSITIES]
_FAST = tuple(flag for flag in STREAMING if flag.speed == 10)
_LEVEL = tuple(flag for flag in FLAGS if flag.speed == 10)

PUBLISHED = (
    Published(
        name="drag-en",
        quantity="C_D",
        condition="a free flag",
        source="EN 1991-1-4, 7.12",
        role=Role.JUDGE,
        sure="the form is known, the text was not opened",
        predicted=_each("drag", STREAMING),
        bands=_of(STREAMING, lambda flag: about(code_drag(flag, constant=0.02), 0.3)),
    ),
    Published(
        name="drag-as",
        quantity="C_D",
        condition="a free flag, flutter included",
        role=Role.FIT,
        source="AS 1170.2:2002, appendix F, as quoted by engineers",
        sure="a quotation was opened",
        predicted=_each("drag", STREAMING),
        bands=_of(STREAMING, lambda flag: about(code_drag(flag, constant=0.05), 0.3)),
    ),
    Published(
        name="drag-hoerner",
        quantity="C_D",
        condition="L/H = 1.5, between 0.06 at 1 and 0.2 at 4; 24 m/s, weight unknown",
        source="Hoerner 1965 after Fairthorne, ARC R&M 1345",
        sure="second hand; the trend with L/H is against the codes'",
        role=Role.JUDGE,
        predicted=_each("drag", _FAST),
        bands=_of(_FAST, lambda _: about(0.06 + 0.14 * 0.5 / 3, 0.3)),
    ),
    Published(
        name="drag-munson",
        quantity="C_D",
        condition="L/H = 2, weight and wind unknown",
        role=Role.NONE,
        source="Munson, Fundamentals of Fluid Mechanics, fig. 9.30",
        sure="second hand",
        bands={"L/H = 2": about(0.12, 0.3)},
    ),
    Published(
        name="drag-navy",
        quantity="C_D",
        condition="0.0003 A V^1.9 (lb, ft², mph) at 10 m/s, weight unknown",
        source="US Navy yard's tunnel",
        sure="second hand",
        role=Role.JUDGE,
        predicted=_each("drag", _FAST),
        bands=_of(_FAST, lambda _: about(0.086, 0.3)),
    ),
    Published(
        name="drag-exponent",
        quantity="n of F ∝ Uⁿ",
        condition="as before, 6 to 10 m/s",
        source="US Navy yard's tunnel",
        sure="second hand; no uncertainty is stated, 0.1 is taken",
        role=Role.JUDGE,
        predicted=_exponents,
        bands=dict.fromkeys(_BY_DENSITY, (1.8, 2.0)),
    ),
    Published(
        name="wavelength",
        quantity="λ/L",
        condition="48 paper flags, clamped along the hoist",
        role=Role.FIT,
        source="Raynaud and Mulleners 2026, arXiv 2602.06237",
        sure="abstract; set-up and scatter were not opened",
        predicted=_each("wavelength", STREAMING),
        bands=_of(STREAMING, lambda _: about(1.87, 0.15)),
    ),
    Published(
        name="wave-speed",
        quantity="c/U",
        condition="as before; less for smaller H/L",
        role=Role.JUDGE,
        source="Raynaud and Mulleners 2026, arXiv 2602.06237",
        sure='abstract: "close to the incoming flow"; 1 is taken',
        predicted=_each("speed", STREAMING),
        bands=_of(STREAMING, lambda _: about(1.0, 0.15)),
    ),
    Published(
        name="frequency",
        quantity="f L/U",
        condition="as before",
        role=Role.JUDGE,
        source="Raynaud and Mulleners 2026, arXiv 2602.06237",
        sure="derived from the two before",
        predicted=_each("frequency", STREAMING),
        bands=_of(STREAMING, lambda _: (0.37, 0.53)),
    ),
    Published(
        name="amplitude-mass",
        quantity="n of amplitude ∝ mⁿ",
        condition="light flags, theory",
        role=Role.JUDGE,
        source="Alben 2021, arXiv 2106.14988",
        sure="abstract; a simulation without viscosity, no uncertainty, 0.2 is taken",
        predicted=_amplitude_exponents,
        bands={f"{u:g} m/s": (0.3, 0.7) for u in (6.0, 10.0)},
    ),
    Published(
        name="droop-45",
        quantity="wind at 45° droop, 2.5 or less at 2.5",
        unit="m/s",
        role=Role.JUDGE,
        predicted=_speed_of_droop,
        condition="a light flag, weight unknown",
        source="meteorologists' rules and Beaufort 3; soldiers say 5.0 m/s",
        sure="lay rules",
        bands=dict.fromkeys(_BY_DENSITY, (3.6, 5.4)),
    ),
    Published(
        name="droop-level",
        quantity="droop",
        unit="rad",
        condition="level at 10 m/s; 10° is taken as level",
        source="soldiers' rule",
        sure="lay rule",
        role=Role.JUDGE,
        predicted=_each("droop", _LEVEL),
        bands=_of(_LEVEL, lambda _: (0.0, math.radians(10))),
    ),
    Published(
        name="hysteresis",
        quantity="onset above stop of flutter",
        condition="clamped, uneven sheets",
        role=Role.NONE,
        source="Mettelsiefen, Sarkar and Raghav, J. Fluid Mech. 1021, 2025",
        sure="abstract",
        bands={"": (1.0, math.inf)},
    ),
    Published(
        name="held-up",
        quantity="lift",
        condition="oblique waves hold a flag up",
        role=Role.NONE,
        source="Hœpffner and Naka, Phys. Rev. Lett. 2011",
        sure="synopsis; no number",
        bands={},
    ),
)
