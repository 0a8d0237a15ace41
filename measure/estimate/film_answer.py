"""The measurement of each quantity: a value with its interval, a bound, or "not constrained by this
clip"."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from flagdata.answer import Bound, Quantity, Span
from flagdata.answer.quantity import Form
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from measure.posterior_ends import PILED, WITHIN, limits_of, span
from models.networks.targets import ASPECT, TARGETS

LEAST_INFORMATION = 0.05
"""Information of a posterior over its prior, Kullback–Leibler of Gaussians of the same moments
[nat]. Below it the film
did not constrain it: a posterior of the same mean then has 78 % of the prior's standard deviation
or more."""


FORMS = {
    "wind_speed": Form(title="wind", unit="m/s", digits=1),
    "area_weight": Form(title="area weight", unit="kg/m²", digits=2),
    "bending_scale": Form(
        title="bending stiffness", unit="µN·m", convert=lambda log: 1e6 * 10.0**log
    ),
    "anisotropy": Form(title="bending, warp over weft", unit="1", convert=lambda log: 10.0**log),
    ASPECT: Form(title="length over height", unit="1", digits=2, convert=math.exp),
}
"""Networks estimate logarithms of the last three; bending is the mean of 15 coefficients."""
SHORT = {name: form.title for name, form in FORMS.items()}
"""Names in the one-line answer."""
HEADLINE = ("wind_speed", "area_weight")
"""What the one-line answer is about."""
_UNITS = {target.name: target.unit for target in TARGETS.values()}


def form_of(quantity: Quantity) -> Form:
    """Returns how a quantity is shown; a light flag's weight with a digit more."""
    form = FORMS[quantity.name]
    light = (
        quantity.name == "area_weight"
        and quantity.assumed is not None
        and quantity.assumed[1] < 0.1
    )
    return replace(form, digits=3) if light else form


def say(quantities: Mapping[str, Quantity], *, weight: bool = True) -> str:
    """Says wind and, where the film constrains it, the cloth's weight in one sentence that can be
    said aloud.

    Args:
        weight: whether the cloth is spoken of.
    """
    wind, cloth = (quantities.get(name) for name in HEADLINE)
    said = [] if wind is None else [_say_one(wind, "the wind", "was")]
    if weight and cloth is not None and cloth.constrained:
        said.append(_say_one(cloth, "the cloth", "weighs", levelled=not said))
    text = "; ".join(said)
    return f"{text[:1].upper()}{text[1:]}."


def _say_one(quantity: Quantity, subject: str, verb: str, *, levelled: bool = True) -> str:
    form, span = form_of(quantity), quantity.span
    if not quantity.constrained:
        return f"the film does not constrain {subject}"
    if span.bound is not None or quantity.value is None:
        end = span.word(form.number, form.suffix)
        return f"{subject} {verb} {end}, at {span.percent}"
    ends = f"between {form.number(span.low)} and {form.number(span.high)}"
    level = f" at {span.percent}" if levelled else ""
    return f"{subject} {verb} {form.number(quantity.value)}{form.suffix}, {ends}{level}"


def phrase(quantity: Quantity, *, first: bool) -> str:
    """Phrases a quantity, without a full stop.

    Args:
        first: whether the level of an interval is stated; that of a bound always is.
    """
    form, span = form_of(quantity), quantity.span
    short, suffix = form.title, form.suffix
    if not quantity.constrained and quantity.assumed is not None:
        if quantity.given and quantity.assumed[0] == quantity.assumed[1]:
            return f"{short} {form.convert(quantity.assumed[0]):g}{suffix}, as given"
        low, high = (_number(quantity, end) for end in quantity.assumed)
        if quantity.given:
            return f"{short} {low} to {high}{suffix}, as given"
        return f"{short}: not constrained by this clip (prior range {low} to {high}{suffix})"
    if span.bound is None:
        interval = span.word(form.number)
        return f"{short} {_number(quantity, quantity.value)}{suffix} {interval}" + (
            f" {span.percent}" if first else ""
        )
    why = "" if quantity.value is not None else f" ({_beyond(quantity)})"
    return f"{short} {span.word(form.number, suffix)}, {span.percent}{why}"


def explain_bound(quantity: Quantity) -> Finding | None:
    """Reports why a quantity has a bound on one side only; None where it has not, or where nothing
    lies beyond the end."""
    if quantity.value is not None or not quantity.constrained:
        return None
    beyond = "more" if quantity.bound is Bound.LEAST else "less"
    return Finding(
        kind=f"{quantity.name.replace('_', '-')}-at-end",
        severity=Severity.WARNING,
        what=f"{SHORT[quantity.name]}: {_beyond(quantity)}, and {PILED:.0%} of the draws or more "
        "lie within "
        f"{WITHIN:.0%} of that end; {beyond} would look the same, so that only a bound is given",
        fix="check --flag-size, with which the range grows",
    )


def _beyond(quantity: Quantity) -> str:
    low, high = quantity.assumed or quantity.interval
    verb, end = ("ends", high) if quantity.bound is Bound.LEAST else ("begins", low)
    return f"the network's range {verb} at {_number(quantity, end)}{form_of(quantity).suffix}"


def _number(quantity: Quantity, value: float | None) -> str:
    return "" if value is None else form_of(quantity).number(value)


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
        places: (k, target) of the draws in the range that the model learned, 0 to 1; of means,
            those of their parts.
        stated_values: name → what the user states of the quantity.

    Raises:
        InputError: a level that is not between 0 and 1.
    """
    if not 0 < level < 1:
        raise InputError(
            f"the level of an interval is {level:g}",
            where="--level",
            fix="give a share between 0 and 1, as in 0.9",
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
        learned = information(draws[:, k], prior[:, k])
        answers.append(
            Quantity(
                name=name,
                unit=_UNITS[name],
                value=float(draws[:, k].mean()) if interval.estimated else None,
                sigma=float(draws[:, k].std()) if interval.estimated else None,
                span=interval,
                assumed=ends,
                constrained=learned >= LEAST_INFORMATION and interval.bound is not Bound.NOTHING,
                information=learned,
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
        constrained=False,
        information=0.0,
        given=True,
    )


def information(posterior: FloatArray, prior: FloatArray) -> float:
    """Computes the Kullback–Leibler divergence of two samples' Gaussians, posterior from prior
    [nat]: ½ (σ²/τ² − 1 − ln σ²/τ² + (m − μ)²/τ²)."""
    variance = float(prior.var())
    ratio = max(float(posterior.var()) / variance, 1e-12)
    shift = float(posterior.mean() - prior.mean())
    return 0.5 * (ratio - 1 - math.log(ratio) + shift**2 / variance)


def sentence(quantities: Sequence[Quantity]) -> str:
    """Phrases the answer in one line."""
    headline = [quantity for name in HEADLINE for quantity in quantities if quantity.name == name]
    constrained = [quantity for quantity in headline if quantity.constrained]
    leading = next((quantity for quantity in constrained if quantity.span.bound is None), None)
    first = [phrase(quantity, first=quantity is leading) for quantity in constrained]
    rest = [phrase(quantity, first=False) for quantity in headline if not quantity.constrained]
    return "; ".join([", ".join(first), *rest] if first else rest)
