"""A proposal in sentences."""

from __future__ import annotations

from flagdata.answer import Quantity
from measure.propose.outcome import ProposalOutcome, Retest

_NEAREST = 4
"""Further terms that are listed."""


def words(outcome: ProposalOutcome) -> str:
    """Describes what was tried, what was found, what became of it."""
    lines = [
        (
            f"{outcome.decision.value}: {outcome.reason} ({outcome.tried} terms were tried; nulls: "
            f"{outcome.nulls})"
        )
    ]
    for step in outcome.steps:
        verb = "taken" if step.taken else f"not taken: {step.reason}"
        lines.append(
            f"  {step.name}: p = {step.p_family:.2g} over all terms, "
            f"held-out gain {step.gain:.1f} ± {step.gain_error:.1f}, {verb}"
        )
    nearest = [
        ranked
        for ranked in outcome.ranking
        if ranked.name not in {step.name for step in outcome.steps}
    ]
    if nearest:
        further = ", ".join(f"{ranked.name} {ranked.gain:.1f}" for ranked in nearest[:_NEAREST])
        lines.append(f"  not tested further, listed by held-out gain: {further}")
    for strength in outcome.strengths:
        lines.append(f"{strength.name} {interval(strength.estimate)}: {strength.words}")
        lines.append(f"  {strength.course.words}")
    if outcome.retest is not None:
        lines += _test_sentences(outcome.retest)
    return "\n".join(lines)


def _test_sentences(tested: Retest) -> list[str]:
    errors = (
        f"on {tested.what}, unseen, n = {tested.segments} segments: error "
        f"{interval(tested.before)} before, "
        f"{interval(tested.after)} after, reduction {interval(tested.reduction)}"
    )
    floor = f"  numerical floor: {interval(tested.floor)}"
    if tested.share is not None:
        floor += f"; of the squared error above it, {100 * tested.share:.0f} % is removed"
    lines = [
        errors,
        floor,
        f"  misfit: lower by {interval(tested.helped)} nat per segment than before",
    ]
    if tested.control is not None and tested.apart is not None:
        lines.append(
            f"  instead with {' and '.join(tested.control_names)}: {interval(tested.control)}, "
            f"whose misfit is higher by {interval(tested.apart)} nat per segment than the "
            "proposal's"
        )
    return lines


def interval(estimate: Quantity) -> str:
    """Formats `value [low, high] unit level`; metres as millimetres."""
    factor, unit = (1e3, "mm") if estimate.unit == "m" else (1.0, estimate.unit)
    value, low, high = (factor * v for v in (estimate.point, estimate.low, estimate.high))
    unit_text = "" if unit == "1" else f" {unit}"
    return f"{value:.3g} [{low:.3g}, {high:.3g}]{unit_text} {100 * estimate.level:.0f} %"
