"""The verdict in sentences: what was found, what was assumed, what would settle what is open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata.core.shell import command_line
from measure.forecasting.recorded import recorded
from measure.forecasting.regressors import FieldColumn, library
from measure.forecasting.segments import Cut
from measure.forecasting.strengths import what_copies, why_unweighed
from measure.loop.corrective_field import Mode
from measure.loop.run import LoopOutcome
from measure.nulls import bank as banks
from measure.nulls.conformal import MOST_KINDS
from measure.probes.lines import STROUHAL, SpectralLine
from measure.probes.wind_course import ALONG, LEFT, Variation
from measure.report.lead_sentences import lead
from measure.trajectories.trajectory import Experiment, Specimen
from measure.verdict.criteria import CRITERIA
from measure.verdict.quantity import number, with_error
from measure.verdict.verdict_record import Conclusion, NullTest, Verdict
from sim.effects.weighing import Need

_SEPARATES: dict[frozenset[str], str] = {
    frozenset(
        {"tangential-linear-drag", "tangential-quadratic-drag"}
    ): "a second wind speed, twice as fast: one drag doubles, the other quadruples",
    frozenset(
        {"added-mass", "reactive-loading"}
    ): "the cloth released in still air, where only its own motion loads it",
    frozenset(
        {"reactive-loading", "finite-span-loading"}
    ): "a flag of another height: the mass of air of finite-span-loading changes with it",
    frozenset(
        {"air-density", "porosity"}
    ): "the air's temperature and pressure: they give its density",
    frozenset(
        {"air-density", "power-law-drag"}
    ): "a second wind speed, twice as fast: a power law changes its scale",
    frozenset(
        {"lift", "power-law-drag"}
    ): "a stiff plate of the same cloth at a few angles to the wind",
    frozenset({"hem-mass", "hem-stiffness"}): "the hem weighed, or the cloth hanging in calm air",
    frozenset(
        {"shear", "vertical-wind"}
    ): "the wind logged at the top and at the bottom of the flag",
}


_ROUGH = 0.1
"""Relative uncertainty of the area weight above which weighing the cloth is better than the
material's name."""
_AXES = ("along the wind", "across the wind", "up")


def with_sentences(outcome: LoopOutcome) -> Verdict:
    """States the verdict of an outcome, with all that it says in sentences."""
    verdict, experiment = outcome.verdict, outcome.experiment
    parts = [lead(verdict), *by_draw(verdict.test), *bounds(outcome.at_bounds), *ratios(experiment)]
    return replace(
        verdict,
        words=" ".join(parts),
        separating=separating(verdict),
        unweighed=unweighed_effects(verdict, experiment),
        copied=tuple(what_copies(_recorded(experiment)).items()),
        proposal=_lacking(outcome),
        assumptions=(
            *assumptions(experiment),
            *clocks(experiment, outcome.lags),
        ),
    )


def _lacking(outcome: LoopOutcome) -> str:
    """Describes what the library lacks, where it has no answer or half of one, and what remains
    beside its answer."""
    sentences = [] if outcome.line is None else [shedding(outcome.line)]
    if outcome.course is not None and outcome.course.total[ALONG] > 0:
        sentences.append(blowing(outcome.course))
    if outcome.field:
        sentences.append(proposal(outcome.field, is_all=outcome.whole))
    return " ".join(sentences)


def by_draw(test: NullTest) -> tuple[str, ...]:
    """Says that other nulls could decide otherwise, and how many would settle it; nothing where
    they hardly could."""
    if not test.open:
        return ()
    if test.settling is None:
        return (
            (
                f"The evidence is borderline; more than {MOST_KINDS} numerical set-ups would be "
                "needed "
                "to decide."
            ),
        )
    nulls = banks.WINDS * test.settling
    more = command_line("--nulls", nulls)
    return (
        (
            f"The evidence is borderline; rerun with {more} ({test.settling} numerical set-ups) to "
            "decide."
        ),
    )


def bounds(ended: Sequence[str]) -> tuple[str, ...]:
    """Says which calibrated parameters are at a bound of the model; nothing where none is."""
    if not ended:
        return ()
    return (f"The fit ends at the bound of {' and '.join(ended)}: its interval is not reliable.",)


def ratios(experiment: Experiment) -> tuple[str, ...]:
    """Says what the numbers are of where the mass of the cloth is not known; nothing where it
    is."""
    if experiment.specimen.area_weight_uncertainty is not None:
        return ()
    sentence = (
        "The mass of the cloth is not known: motion shows forces per mass alone, so that area "
        "weight, bending and the "
        "strengths of forces are ratios to an area weight of "
        f"{number(experiment.specimen.material.area_weight)} kg/m²."
    )
    return (sentence,)


def clocks(experiment: Experiment, late: Sequence[float]) -> tuple[str, ...]:
    """Says by how much the logs of the wind were moved, estimated from the errors [s]; nothing
    where none was."""
    moved = [
        f"{recording.name} by {number(lag, digits=2)} s"
        for recording, lag in zip(experiment.recordings, late, strict=True)
        if lag
    ]
    return (
        (f"by the motion of the cloth the log of the wind lags; it was moved: {', '.join(moved)}",)
        if moved
        else ()
    )


def unweighed_effects(verdict: Verdict, experiment: Experiment) -> tuple[tuple[str, str], ...]:
    """Lists the effects that were not weighed, and why."""
    ranked = {candidate.effect for candidate in verdict.ranking}
    why = {column.effect: _NOT_HERE for column in library()}
    why |= why_unweighed(_recorded(experiment))
    return tuple((effect, reason) for effect, reason in why.items() if effect not in ranked)


_NOT_HERE = "the cloth cannot have it as it is held and in its wind"


def _recorded(experiment: Experiment) -> frozenset[Need]:
    return recorded(experiment.specimen, experiment.recordings)


def separating(verdict: Verdict) -> str:
    """Names the cheapest known experiment that separates the named effects."""
    if verdict.conclusion is not Conclusion.ONE_OF:
        return ""
    pairs = [text for effects, text in _SEPARATES.items() if effects <= set(verdict.named)]
    if pairs:
        return "; ".join(pairs)
    return (
        "a longer recording, at one more wind speed: the effects named differ in how they grow "
        "with the wind"
    )


def proposal(modes: Sequence[Mode], *, is_all: bool = True) -> str:
    """Describes the corrective field: the most significant modes.

    Args:
        is_all: whether it is all that the base model lacks, or what a named effect leaves.
    """
    largest = sorted(modes, key=lambda mode: -abs(mode.value / mode.error))[:3]
    terms = [
        f"{_where(mode.column)} ({with_error(mode.value, mode.error)}) m/s²" for mode in largest
    ]
    fitted = "fits the errors best" if is_all else "fits the remaining errors best"
    return f"The smooth force field that {fitted}, per mass: {'; '.join(terms)}."


def shedding(line: SpectralLine) -> str:
    """Describes a line of the errors' spectra."""
    return (
        f"The errors oscillate {_AXES[line.axis]} at {line.reduced:.2g} Hz for each m/s of wind, "
        "as vortices behind a "
        f"cylinder of {number(STROUHAL / line.reduced, digits=2)} m do."
    )


def blowing(variation: Variation) -> str:
    """Describes a course of the wind that is none of turbulence."""
    along, turned = (math.sqrt(max(variation.total[part], 0.0)) for part in (ALONG, LEFT))
    fast = math.sqrt(max(variation.fast[ALONG], 0.0))
    return (
        f"The errors look like those of a wind that varies by {number(100 * along, digits=2)} % of "
        "its mean along its "
        f"own direction, by {number(100 * fast, digits=2)} % within two seconds, and by "
        f"{number(100 * turned, digits=2)} % across it."
    )


def _where(mode: FieldColumn) -> str:
    shapes = {
        (0, 0): "all over",
        (1, 0): "hoist against fly",
        (0, 1): "bottom against top",
        (1, 1): "corner against corner",
        (2, 0): "both ends against the middle",
    }
    return f"{_AXES[mode.axis]}, {shapes[mode.mode]}"


def _how_well_weighed(specimen: Specimen) -> tuple[str, ...]:
    """Says how well the cloth's mass is known, and what that leaves open; nothing where it is not
    known."""
    uncertainty, weight = specimen.area_weight_uncertainty, specimen.material.area_weight
    if uncertainty is None:
        return ()
    known_to = f"its area weight is known to {100 * uncertainty:.2g} % (one standard deviation)"
    weighing = (
        ": a pressure of the air that is off by as much differs from another weight only in how "
        "the cloth stretches, "
        "which a cloth that was weighed to 2 % would settle (area weight "
        f"{weight:.3g}±{0.02 * weight:.1g})"
    )
    return (known_to + weighing if uncertainty >= _ROUGH else known_to,)


def assumptions(experiment: Experiment) -> tuple[str, ...]:
    """Lists what was taken as given."""
    specimen = experiment.specimen
    size = np.ptp(specimen.mesh.rest, axis=0)
    air = specimen.air.plain
    cut = Cut.of(
        experiment.recordings[0].rate, min(len(r.positions) for r in experiment.recordings)
    )
    which_frames = "every frame" if cut.stride == 1 else f"every {cut.stride}th frame"
    winds = [recording.wind.uncertainty for recording in experiment.recordings]
    gain, direction, clock = (max(parts) for parts in zip(*winds, strict=True))
    logged = (
        "the wind at the flag is the same all over it, and the logged one within standard "
        "deviations of "
        f"{number(100 * gain, digits=2)} % in speed, {number(math.degrees(direction), digits=2)}° "
        "in direction and "
        f"{number(clock, digits=2)} s in time"
    )
    attachment = (
        "rigidly"
        if math.isinf(specimen.stiffness)
        else f"by springs of {number(specimen.stiffness)} N/m"
    )
    if experiment.carried:
        places = ", carried where the markers at them go"
    else:
        places = "" if specimen.anchors_given else ", tied at their mean observed places"
    between = (
        "intervals of these include the scatter between simulators of other authors, "
        f"{100 * CRITERIA.area_weight_between:.0f} % in area weight, a factor of "
        f"{math.exp(CRITERIA.bending_between):.1f} in "
        f"bending and {number(1e3 * CRITERIA.damping_between, digits=2)} ms in damping, and for "
        "the damping a factor "
        f"of {math.exp(CRITERIA.damping_factor):.0f} by which its fit may end elsewhere, each one "
        "standard deviation"
    )
    factor = number(math.exp(CRITERIA.strength_factor), digits=2)
    cloth = f"{specimen.material.name} (nominally {number(specimen.material.area_weight)} kg/m²)"
    return (
        f"the cloth is {size[0]:.3g} m × {size[1]:.3g} m of {cloth}, whose stretching is known",
        *_how_well_weighed(specimen),
        f"it is held at {len(specimen.held)} points {attachment}{places}",
        (
            "the base model's air pushes along the cloth's normal with ρ w² per area, ρ = "
            f"{number(air.density)} kg/m³"
        ),
        logged,
        (
            f"predictions are made {number(1e3 * cut.period, digits=2)} ms ahead, at "
            f"{which_frames} of "
            "the recordings"
        ),
        (
            "area weight, bending and internal damping are calibrated, so that what only changes "
            "them "
            "is not an effect"
        ),
        between,
        (
            f"a strength may be off by a factor of {factor} by the fit's mesh and a mistold cloth: "
            "its "
            "interval says so"
        ),
        (
            "the effect was chosen on all recordings; the errors before and after come from fits "
            "without them"
        ),
    )
