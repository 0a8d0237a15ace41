"""The measurement of each quantity: a value with its interval, a bound, or "not constrained by this clip"."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flagdata.arrays import FloatArray
from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from flagdata.stated import Stated
from measure.ends import PILED, WITHIN, Bound, Span, limits_of, span
from models.targets import ASPECT, TARGETS

LEAST_INFORMATION = 0.05
"""Information of a posterior over its prior, Kullback–Leibler of Gaussians of the same moments [nat]. Below it the film
did not constrain it: a posterior of the same mean then has 78 % of the prior's standard deviation or more."""
SHORT = {
    "wind_speed": "wind",
    "area_weight": "area weight",
    "bending_scale": "bending",
    "anisotropy": "anisotropy",
    ASPECT: "logarithm of length over height",
}
"""Names in the one-line answer."""
HEADLINE = ("wind_speed", "area_weight")
"""What the one-line answer is about."""
_UNITS = {target.name: target.unit for target in TARGETS.values()}
_DIGITS = {"wind_speed": 1, "area_weight": 2, "bending_scale": 2, "anisotropy": 2, ASPECT: 2}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One target, measured.

    Attributes:
        name: of `models.targets.TARGETS`.
        unit: SI.
        value: mean of the posterior; None where its draws pile up at an end of the range that is not one of the
            quantity's own.
        sigma: its standard deviation, likewise.
        span: central interval of the measurement's level, or a bound on one side (`measure.ends`).
        assumed: the range that the simulations covered, for this size of flag, or what was stated.
        information: what the film added to that, see `LEAST_INFORMATION` [nat].
        given: whether it was stated where it lies.
    """

    name: str
    unit: str
    value: float | None
    sigma: float | None
    span: Span
    assumed: tuple[float, float]
    information: float
    given: bool = False

    @property
    def constrained(self) -> bool:
        """Whether the film adds information to the prior."""
        return self.information >= LEAST_INFORMATION and self.span.bound is not Bound.NOTHING

    def phrase(self, *, first: bool) -> str:
        """Phrases the quantity, without a full stop.

        Args:
            first: whether the level of an interval is stated; that of a bound always is.
        """
        short, bound = SHORT[self.name], self.span.bound
        if not self.constrained:
            if self.given and self.assumed[0] == self.assumed[1]:
                return f"{short} {self.value:g}{self._suffix}, as given"
            low, high = (self._number(end) for end in self.assumed)
            if self.given:
                return f"{short} {low} to {high}{self._suffix}, as given"
            return f"{short}: not constrained by this clip (prior range {low} to {high}{self._suffix})"
        level = f"{self.span.level * 100:.3g} %"
        if bound is None:
            interval = self.span.phrase(self._digits)
            return f"{short} {self._number(self.value)}{self._suffix} {interval}" + (f" {level}" if first else "")
        why = "" if self.value is not None else f" ({self._beyond})"
        return f"{short} {self.span.phrase(self._digits, self._suffix)}, {level}{why}"

    def finding(self) -> Finding | None:
        """Reports why it has a bound on one side only; None where it has not, or where nothing lies beyond the end."""
        if self.value is not None or not self.constrained:
            return None
        beyond = "more" if self.span.bound is Bound.LEAST else "less"
        return Finding(
            kind=f"{self.name.replace('_', '-')}-at-end",
            severity=Severity.WARNING,
            what=f"{SHORT[self.name]}: {self._beyond}, and {PILED:.0%} of the draws or more lie within {WITHIN:.0%} of "
            f"that end; {beyond} would look the same, so that only a bound is given",
            fix="check --flag-size, with which the range grows",
        )

    @property
    def _beyond(self) -> str:
        verb, end = ("ends", self.assumed[1]) if self.span.bound is Bound.LEAST else ("begins", self.assumed[0])
        return f"the network's range {verb} at {self._number(end)}{self._suffix}"

    @property
    def _digits(self) -> int:
        light = self.name == "area_weight" and self.assumed[1] < 0.1  # of a small flag
        return _DIGITS[self.name] + light

    @property
    def _suffix(self) -> str:
        return "" if self.unit == "1" else f" {self.unit}"

    def _number(self, value: float | None) -> str:
        return "" if value is None else f"{value:.{self._digits}f}"

    def as_dict(self) -> dict[str, Any]:
        """Returns JSON values; an end of the interval that nothing bounds is null."""
        return {
            "unit": self.unit,
            "value": self.value,
            "sigma": self.sigma,
            **self.span.as_dict(),
            "assumed": list(self.assumed),
            "information": self.information,
            "constrained": self.constrained,
            "given": self.given,
        }


def quantities(
    draws: FloatArray,
    prior: FloatArray,
    names: Sequence[str],
    *,
    level: float,
    assumed: FloatArray,
    places: FloatArray,
    stated_values: Mapping[str, Stated],
) -> tuple[Quantity, ...]:
    """Summarises all quantities of a posterior.

    Args:
        draws: (n, target) of the posterior.
        prior: (m, target) of what was assumed.
        names: of the targets.
        level: share of each central interval.
        assumed: (target, 2) range of the simulations, for this size of flag.
        places: (k, target) of the draws in the range that the model learned, 0 to 1; of means, those of their parts.
        stated_values: name → what the user states of the quantity.

    Raises:
        InputError: a level that is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(
            f"the level of an interval is {level:g}", where="--level", fix="give a share between 0 and 1, as in 0.9"
        )
    answers = []
    for k, name in enumerate(names):
        ends = float(assumed[k, 0]), float(assumed[k, 1])
        stated_value, limits = stated_values.get(name), limits_of(name)
        if stated_value is not None and stated_value.exact:
            answers.append(_exact(name, stated_value.low, level=level))
            continue
        if stated_value is not None and not stated_value.sigma:
            limits = stated_value.low, stated_value.high
        interval = span(draws[:, k], places[:, k], level=level, limits=limits, assumed=ends)
        answers.append(
            Quantity(
                name=name,
                unit=_UNITS[name],
                value=float(draws[:, k].mean()) if interval.estimated else None,
                sigma=float(draws[:, k].std()) if interval.estimated else None,
                span=interval,
                assumed=ends,
                information=information(draws[:, k], prior[:, k]),
                given=stated_value is not None,
            )
        )
    return tuple(answers)


def _exact(name: str, value: float, *, level: float) -> Quantity:
    """Returns a quantity whose value the user stated."""
    exact = Span(low=value, high=value, level=level, bound=None, estimated=True)
    return Quantity(
        name=name,
        unit=_UNITS[name],
        value=value,
        sigma=0.0,
        span=exact,
        assumed=(value, value),
        information=0.0,
        given=True,
    )


def information(posterior: FloatArray, prior: FloatArray) -> float:
    """Computes the Kullback–Leibler divergence of two samples' Gaussians, posterior from prior [nat]: ½ (σ²/τ² − 1 − ln
    σ²/τ² + (m − μ)²/τ²)."""
    variance = float(prior.var())
    ratio = max(float(posterior.var()) / variance, 1e-12)
    shift = float(posterior.mean() - prior.mean())
    return 0.5 * (ratio - 1 - math.log(ratio) + shift**2 / variance)


def sentence(quantities: Sequence[Quantity]) -> str:
    """Phrases the answer in one line."""
    headline = [quantity for name in HEADLINE for quantity in quantities if quantity.name == name]
    constrained = [quantity for quantity in headline if quantity.constrained]
    leading = next((quantity for quantity in constrained if quantity.span.bound is None), None)
    first = [quantity.phrase(first=quantity is leading) for quantity in constrained]
    rest = [quantity.phrase(first=False) for quantity in headline if not quantity.constrained]
    return "; ".join([", ".join(first), *rest] if first else rest)
