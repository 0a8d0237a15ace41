"""Flags of another size, by dynamic similarity: what a model of a 1.5 m flag says of a flag of any
length.

The equation of motion of a cloth with area weight ρ_s and bending stiffness B in air of density ρ_a
at speed U is, in terms of the orders of its parts,

    ρ_s ẍ  =  ρ_a U² f(shape, ẋ/U)  +  B ∂⁴x  +  E ∂²x (stretching)  +  ρ_s g.

Lengths are measured in L, times in √(L/g), speeds in √(gL), and everything is divided by ρ_s g.
What is left are the numbers

    U²/(gL)  (Froude),   ρ_s/(ρ_a L)  (mass ratio),   B/(ρ_s g L³),   E/(ρ_s g L).

Two flags that agree in these, in the shape and in the way they are held move alike: x(t)/L is the
same function of t√(g/L). Gravity and air are the same for both. So a flag that is s times as long
as another moves like it if

    U ∝ √s,   t ∝ √s,   ρ_s ∝ s,   B ∝ ρ_s L³ ∝ s⁴,   E ∝ ρ_s L ∝ s²,   internal damping time ∝ √s.

A flag of length s · 1.5 m is therefore shown to the model in frames √s/25 s apart, and wind, area
weight and bending stiffness are scaled back by √s, s and s⁴; ratios of stiffnesses stay. Two things
do not follow the rule: a fabric's stretching stiffness E does not grow with the flag, which matters
little as long as the cloth hardly stretches, and its bending table changes at curvatures of 5, 10,
15 and 20 1/m, not at multiples of 1/L. The Reynolds number, on which the simulated air's force does
not depend, is another.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.shell import command_line
from flagdata.errors import RefusedError, UnknownNameError, UsageError
from measure.gate.reasons import REASONS
from models.networks.targets import ASPECT, Cloth, Target


@dataclass(frozen=True, kw_only=True)
class Trained:
    """The cloths that a model is trained on: all of one size, and of one shape or of shapes that it
    knows of.

    Attributes:
        noun: what they are called.
        length: of a flag along the wind, of a hanging cloth along the edge that is held [m].
        aspects: the least and the largest length over height.
    """

    noun: str
    length: float
    aspects: tuple[float, float]


TRAINED = {
    Cloth.FLAG: Trained(noun="flag", length=1.5, aspects=(1.5, 1.5)),
    Cloth.HANGING: Trained(noun="cloth", length=1.0, aspects=(1.0, 1.0)),
}
FLAG = TRAINED[Cloth.FLAG]


def trained_on(targets: Sequence[Target]) -> Trained:
    """Returns the cloths that a model with these targets is trained on; one that estimates the
    aspect knows several."""
    trained = TRAINED[targets[0].cloth]
    ends = [
        (math.exp(target.low), math.exp(target.high)) for target in targets if target.name == ASPECT
    ]
    return replace(trained, aspects=ends[0]) if ends else trained


_SHORTEST, _LONGEST = 0.1, 20.0  # m
_ASPECT_SLACK = 0.05  # relative; printed sizes are rounded
_SIZE = re.compile(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*[x×]\s*(\d+(?:\.\d*)?|\.\d+)\s*(?:m)?\s*")

POWERS: dict[str, float] = {"wind_speed": 0.5, "area_weight": 1.0}
"""Powers of s by which quantities grow."""
LOGARITHMS: dict[str, float] = {"bending_scale": 4.0, "anisotropy": 0.0, "log_aspect": 0.0}
"""The same of quantities known by their logarithm, base 10 (an aspect, which does not scale, by the
natural one)."""


@dataclass(frozen=True, kw_only=True)
class FlagSize:
    """Length along the wind and height along the pole [m]; of a hanging cloth its width and height.

    Raises:
        UsageError: a size that no flag has.
    """

    length: float
    height: float

    @classmethod
    def of(cls, sides: FlagSize | tuple[float, float] | str) -> FlagSize:
        """Returns the size that its two sides are, length and height [m], or a text such as
        "1.5x1.0".

        Raises:
            UsageError: another text.
        """
        if isinstance(sides, FlagSize):
            return sides
        if isinstance(sides, tuple):
            return cls(length=sides[0], height=sides[1])
        match = _SIZE.fullmatch(sides)
        if match is None:
            raise UsageError(
                f"{sides!r} is not a flag's size",
                where="--flag-size",
                fix="give length x height in metres, as in 1.5x1.0",
            )
        return cls(length=float(match[1]), height=float(match[2]))

    @property
    def sides(self) -> tuple[float, float]:
        """Length and height [m]."""
        return self.length, self.height

    def __post_init__(self) -> None:
        if not (_SHORTEST <= self.length <= _LONGEST and _SHORTEST <= self.height <= _LONGEST):
            raise UsageError(
                f"the flag is {self.length:g} m × {self.height:g} m",
                where="--flag-size",
                fix=f"give length x height in metres, each from {_SHORTEST:g} to {_LONGEST:g}, as "
                "in 1.5x1.0",
            )

    @property
    def aspect(self) -> float:
        """Length over height."""
        return self.length / self.height

    def scale(self, trained: Trained = FLAG) -> float:
        """Returns s, the length in lengths of the cloths that the model is trained on."""
        return self.length / trained.length

    def findings(self, trained: Trained = FLAG) -> tuple[Finding, ...]:
        """Reports what is to be said of its shape."""
        aspect = self.aspect
        least, most = trained.aspects
        if least * (1 - _ASPECT_SLACK) <= aspect <= most * (1 + _ASPECT_SLACK):
            return ()
        return (
            Finding.of(
                "aspect-ratio",
                f"the {trained.noun} is {aspect:.2f} times as long as it is high, those of the "
                "training "
                + (f"{least:.2f}" if least == most else f"{least:.2f} to {most:.2f}")
                + " times: similarity is exact for one shape only, so that intervals may be too "
                "narrow",
                value=aspect,
            ),
        )


@dataclass(frozen=True, kw_only=True)
class SizePrior:
    """What is assumed of a flag's length where nobody states it: a log-normal distribution.

    A flag's median is the 1.5 m × 1.0 m (5 ft × 3 ft) flag, the most common size on house and club
    poles; a factor of 1.3 for one standard deviation puts 90 % of the flags between 0.97 m and 2.31
    m. It is a choice of this project, not a measured distribution.

    Attributes:
        median: [m].
        factor: e to the standard deviation of the logarithm.
    """

    median: float = 1.5
    factor: float = 1.3

    def share_above(self, length: float) -> float:
        """Returns the share of the flags that are longer than `length` [m]."""
        return float(ndtr(-math.log(length / self.median) / math.log(self.factor)))

    def quantile(self, share: FloatArray) -> FloatArray:
        """Lengths that these shares of the flags stay below [m]."""
        return self.median * np.exp(math.log(self.factor) * ndtri(share))


STRATA = 3
"""Parts of equal probability that a distribution of sizes is cut into; the model looks at the
middle of each. More follow the size's uncertainty better and take time in proportion."""
LEAST_SHARE = 0.5
"""Share of the prior that the frame rate must admit."""
RATE_SLACK = 0.95
"""A film may be this much slower than the network's frames: one frame in twenty is then shown
twice. It admits films of 24 frames a second for a model of 25."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sizes:
    """What lengths are considered, in lengths of the flags that models are trained on.

    Attributes:
        given: the size that was stated; None where it was not.
        scale: (i,) s at which the model looks at the film.
        draws: (i, n) s of each draw of the posterior at that stratum; all equal where the size is
            given.
        findings: on the size.
    """

    given: FlagSize | None
    scale: FloatArray
    draws: FloatArray
    findings: tuple[Finding, ...]

    def only(self, places: Sequence[int]) -> Sizes:
        """Selects some of the sizes, those at which the film is one that the model can judge."""
        chosen = list(places)
        left_out = [index for index in range(len(self.scale)) if index not in chosen]
        if not left_out:
            return self
        finding = Finding.of(
            "sizes-left-out",
            f"{len(left_out)} of {len(self.scale)} sizes of flag were left out of the answer: at "
            + " and ".join(f"{self.scale[index]:.2f}" for index in left_out)
            + " times the size of the training's flags the film is unlike what the network was "
            "trained on",
            count=len(left_out),
            fix="give --flag-size LENGTHxHEIGHT",
        )
        return replace(
            self,
            scale=self.scale[chosen],
            draws=self.draws[chosen],
            findings=(*self.findings, finding),
        )


def sizes(
    stated_size: FlagSize | None,
    *,
    rate: float,
    frames_rate: float,
    draws: int,
    generator: np.random.Generator,
    prior: SizePrior | None = None,
    trained: Trained = FLAG,
) -> Sizes:
    """Chooses the lengths to consider for a film.

    Of an unknown size the prior is cut into `STRATA` parts of equal probability. The model looks at
    the film as that of a flag of each part's median length; what it says in scaled units, which
    changes slowly with s, is scaled back by lengths drawn within the part.

    Args:
        stated_size: None if unknown.
        rate: of the film [Hz].
        frames_rate: of the network's frames [Hz].
        draws: for each stratum.
        generator: for the lengths within the strata.
        prior: of the length; by default about the length of those of the training.
        trained: the cloths that the model is trained on.

    Raises:
        RefusedError: the film is too slow for the flag's size, or for half of what is likely where
            that is unknown.
    """
    prior = prior if prior is not None else SizePrior(median=trained.length)
    if stated_size is not None:
        scale = stated_size.scale(trained)
        needed = RATE_SLACK * frames_rate / math.sqrt(scale)
        if rate < needed:
            raise RefusedError(
                f"{REASONS['low-frame-rate'].sentence}: {rate:.4g}, and a {trained.noun} of "
                f"{stated_size.length:g} m "
                "needs "
                f"{needed:.4g}",
                where="frame rate",
                fix=f"film at {math.ceil(10 * needed) / 10:g} frames a second or more"
                + length_first(stated_size),
            )
        return Sizes(
            given=stated_size,
            scale=np.array([scale]),
            draws=np.full((1, draws), scale),
            findings=stated_size.findings(trained),
        )
    least = trained.length * (RATE_SLACK * frames_rate / rate) ** 2
    admitted = prior.share_above(least)
    if admitted < LEAST_SHARE:
        enough = RATE_SLACK * frames_rate * math.sqrt(trained.length / prior.median)
        raise RefusedError(
            f"{REASONS['low-frame-rate'].sentence}: {rate:.4g}, not enough for a {trained.noun} "
            "shorter than "
            f"{least:.2f} m, and its size was not given",
            where="frame rate",
            fix=f"give --flag-size if the {trained.noun} is larger, or film at {enough:.3g} Hz or "
            "more",
        )
    below = 1 - admitted
    edges = below + admitted * np.arange(STRATA + 1) / STRATA
    middles = (edges[:-1] + edges[1:]) / 2
    within = edges[:-1, None] + (edges[1:] - edges[:-1])[:, None] * generator.uniform(
        size=(STRATA, draws)
    )
    low, high = prior.quantile(np.array([below + 0.05 * admitted, 1 - 0.05 * admitted]))
    findings = [
        Finding.of(
            "size-assumed",
            f"the {trained.noun}'s size was not given: lengths from {low:.2f} to {high:.2f} m (90 "
            "%) were taken "
            "as possible and widen the intervals",
            value=prior.median,
            fix="give --flag-size LENGTHxHEIGHT",
        )
    ]
    if below > 0.01:
        findings.append(
            Finding.of(
                "small-sizes-left-out",
                f"at {rate:.4g} frames a second {trained.noun}s shorter than {least:.2f} m cannot "
                "be judged; "
                f"{below:.0%} of what was assumed of the size was left out",
                value=below,
                fix="give --flag-size, or film faster",
            )
        )
    return Sizes(
        given=None,
        scale=prior.quantile(middles) / trained.length,
        draws=prior.quantile(within) / trained.length,
        findings=tuple(findings),
    )


def length_first(stated_size: FlagSize | None) -> str:
    """Returns what a remedy adds where a flag is stated higher than long, as one whose height was
    typed first: the size in the other order."""
    if stated_size is None or stated_size.length >= stated_size.height:
        return ""
    return (
        f"; the length comes first: of a flag {stated_size.length:g} m high and "
        f"{stated_size.height:g} m long give "
        + command_line("--flag-size", f"{stated_size.height:g}x{stated_size.length:g}")
    )


def spacing(scale: float, *, rate: float) -> float:
    """Returns the time between frames at which a flag of scale s looks like the model's at `rate`
    [s]."""
    return math.sqrt(scale) / rate


def scaled_back(
    values: NDArray[np.floating], names: Sequence[str], scale: FloatArray | float
) -> FloatArray:
    """Converts what a model said of a flag of scale s to that flag's own.

    Args:
        values: (…, target) as the model says them.
        names: of the targets.
        scale: s, a number or (…,).

    Raises:
        UnknownNameError: a target whose scaling is not known.
    """
    out = np.array(values, dtype=np.float64)
    s = np.asarray(scale, dtype=np.float64)
    for column, name in enumerate(names):
        if name in POWERS:
            out[..., column] *= s ** POWERS[name]
        elif name in LOGARITHMS:
            out[..., column] += LOGARITHMS[name] * np.log10(s)
        else:
            raise UnknownNameError.of("scaled quantity", name, {**POWERS, **LOGARITHMS})
    return out
