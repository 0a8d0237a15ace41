"""What a measurement says of each quantity: a value with its interval, or that the film told nothing of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from models.targets import TARGETS

LEAST_INFORMATION = 0.05
"""Information of a posterior over its prior, Kullback–Leibler of Gaussians of the same moments [nat]. Below it the film
told nothing: a posterior of the same mean then has 78 % of the prior's standard deviation or more."""
SHORT = {"wind_speed": "wind", "density": "area weight", "bending_scale": "bending", "anisotropy": "anisotropy"}
"""Names in the one-line answer."""
HEADLINE = ("wind_speed", "density")
"""What the one-line answer is about."""
_DIGITS = {"wind_speed": 1, "density": 2, "bending_scale": 2, "anisotropy": 2}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One target, measured.

    Attributes:
        name: of `models.targets.TARGETS`.
        unit: SI.
        value: mean of the posterior.
        sigma: its standard deviation.
        low, high: central interval of the measurement's level.
        assumed: the range that the simulations covered, for this size of flag.
        information: what the film added to that, see `LEAST_INFORMATION` [nat].
    """

    name: str
    unit: str
    value: float
    sigma: float
    low: float
    high: float
    assumed: tuple[float, float]
    information: float

    @property
    def told(self) -> bool:
        """Whether the film says more of it than was assumed."""
        return self.information >= LEAST_INFORMATION

    def phrase(self, *, level: float, first: bool) -> str:
        """In words, without a full stop.

        Args:
            level: of the interval.
            first: whether the level is stated.
        """
        light = self.name == "density" and self.assumed[1] < 0.1  # of a small flag
        digits = _DIGITS[self.name] + light
        short = SHORT[self.name]
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not self.told:
            low, high = self.assumed
            return f"{short}: not told by this clip; {low:.{digits}f} to {high:.{digits}f}{unit} is what was assumed"
        stated = f" {level * 100:.3g} %" if first else ""
        return f"{short} {self.value:.{digits}f}{unit} [{self.low:.{digits}f}, {self.high:.{digits}f}]{stated}"

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {
            "unit": self.unit, "value": self.value, "sigma": self.sigma, "interval": [self.low, self.high],
            "assumed": list(self.assumed), "information": self.information, "told": self.told,
        }  # fmt: skip


def quantities(
    draws: NDArray[np.float64], prior: NDArray[np.float64], names: Sequence[str], *, level: float,
    assumed: NDArray[np.float64],
) -> tuple[Quantity, ...]:  # fmt: skip
    """All quantities of a posterior.

    Args:
        draws: (n, target) of the posterior.
        prior: (m, target) of what was assumed.
        names: of the targets.
        level: share of each central interval.
        assumed: (target, 2) range of the simulations, for this size of flag.

    Raises:
        InputError: a level that is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(f"an interval of {level:g}", where="--level", fix="give a share between 0 and 1, as in 0.9")
    low, high = np.quantile(draws, [(1 - level) / 2, (1 + level) / 2], axis=0)
    return tuple(
        Quantity(
            name=name, unit=TARGETS[name].unit, value=float(draws[:, k].mean()), sigma=float(draws[:, k].std()),
            low=float(low[k]), high=float(high[k]), assumed=(float(assumed[k, 0]), float(assumed[k, 1])),
            information=information(draws[:, k], prior[:, k]),
        )
        for k, name in enumerate(names)
    )  # fmt: skip


def information(posterior: NDArray[np.float64], prior: NDArray[np.float64]) -> float:
    """Kullback–Leibler divergence of two samples' Gaussians, posterior from prior [nat]:
    ½ (σ²/τ² − 1 − ln σ²/τ² + (m − μ)²/τ²)."""
    variance = float(prior.var())
    ratio = max(float(posterior.var()) / variance, 1e-12)
    shift = float(posterior.mean() - prior.mean())
    return 0.5 * (ratio - 1 - math.log(ratio) + shift**2 / variance)


def sentence(found: Sequence[Quantity], *, level: float) -> str:
    """The answer in one line."""
    shown = [quantity for name in HEADLINE for quantity in found if quantity.name == name]
    told = [quantity for quantity in shown if quantity.told]
    first = [quantity.phrase(level=level, first=not place) for place, quantity in enumerate(told)]
    rest = [quantity.phrase(level=level, first=False) for quantity in shown if not quantity.told]
    return "; ".join([", ".join(first), *rest] if first else rest)
