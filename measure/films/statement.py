"""The verdict on films in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from measure.calibrate.observed import Observed, constant_wind
from measure.films.departures import Departure
from measure.observables import OBSERVABLES
from measure.report.lead_sentences import lead
from measure.report.sentences import listed
from measure.verdict.decided import NOT_REJECTED
from measure.verdict.quantity import number
from measure.verdict.record import Conclusion, Verdict

_MOST = 4
"""Observables that are named."""


def stated(
    verdict: Verdict,
    recordings: Sequence[Observed],
    *,
    weighed: bool,
    unseen: tuple[str, ...],
    departing: tuple[Departure, ...],
) -> Verdict:
    """The verdict with all that it says in sentences.

    Args:
        weighed: whether the cloth's area weight was stated.
        unseen: effects that these recordings would not show.
        departing: what departs from the base model.
    """
    return replace(
        verdict,
        words=lead(verdict),
        assumptions=assumptions(recordings, weighed=weighed, unseen=unseen),
        proposal=missing(departing) if verdict.conclusion not in NOT_REJECTED else "",
        separating=separating(verdict, weighed=weighed),
    )


def separating(verdict: Verdict, *, weighed: bool) -> str:
    """What would decide between several effects.

    Args:
        weighed: whether the cloth's area weight was stated.
    """
    if verdict.conclusion is not Conclusion.ONE_OF:
        return ""
    return f"a recording in another wind, or {'more minutes of it' if weighed else 'the cloth weighed (--area-weight)'}"


def missing(departing: Sequence[Departure]) -> str:
    """The size of what the base model lacks."""
    if not departing:
        return ""
    parts = []
    for one in departing[:_MOST]:
        unit = OBSERVABLES[one.observable].unit
        sign = "+" if one.off > 0 else ""
        parts.append(
            f"{one.observable} {sign}{number(one.off, digits=2)}{'' if unit == '1' else f' {unit}'} "
            f"({one.recording}; {number(abs(one.deviations), digits=2)} standard deviations of replicates)"
        )
    return f"What the base model as calibrated does not show, observed less predicted: {', '.join(parts)}."


def assumptions(recordings: Sequence[Observed], *, weighed: bool, unseen: tuple[str, ...]) -> tuple[str, ...]:
    """What was taken as given."""
    steady = bool(constant_wind(recordings))
    made = [
        "the flag has the stated size and is held as stated, and the camera is where it is stated to be",
        "area weight, bending and damping are calibrated, so that what only changes them is not an effect",
    ]
    if not weighed:
        made.append(
            "the cloth was not weighed: its weight, the air's density and drag, holes in the cloth, wetness and the "
            "anemometer's gain act alike in a film, so that none of them is found beyond what is assumed of them"
        )
    if steady:
        made.append(
            "the wind hardly changes: a film in one steady wind shows only the ratio of the air's pressure to the "
            "cloth's weight"
        )
    if unseen:
        made.append(
            f"even where they are strong, {listed(unseen)} would move what these recordings show by less than two "
            "standard errors beyond what another cloth or view does: they are not excluded"
        )
    made.append("a wind that is turned from its log looks like another place of the camera, and is not weighed")
    return tuple(made)
