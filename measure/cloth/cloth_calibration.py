"""From recordings of one flag to its cloth: simulated, emulated, weighed, and checked on
simulations left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.answer import Bound, Quantity
from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import child_seed, stream
from flagdata.core.workload import one_thread
from measure.cloth.calibration_result import Calibration, Check, Fitted
from measure.cloth.cloth_posterior import Posterior, Sight, posterior, weigh_cloths
from measure.cloth.design import CalibrationOptions, designs_of, simulated_values
from measure.cloth.emulator import TAKEN_APART, Emulator, informative
from measure.cloth.flag_prior import CLOTH, NUISANCES, Uncertain
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.numerics import Correction, measure_correction, with_errors
from measure.cloth.observed_recording import (
    LEAST_IN_ALL,
    LEFT_OUT,
    Observed,
    check_in_all,
    constant_wind,
    shown,
    usable,
)
from measure.observables.observable import WINDOW
from measure.posterior_ends import PILED, WITHIN, span

ANSWER = 5
"""Raised when the same recordings and options get another answer."""
DETERMINED = 0.8
"""Share of the prior's spread, in ranks, below which a posterior is an answer: above it, it is the
prior. Higher gives a value where the film says little; lower withholds more of them."""
_FOLDS = 8
_CHECKED = 48
"""Simulations left out that are weighed to check the intervals. More make the check of the
intervals surer, and slower in proportion."""
_LOOK = (
    "look at the readings with flagdata observe --picture, check --flag-size, --attachment, "
    "--azimuth, --elevation and "
    "--distance; flagdata close-loop looks for what is missing"
)


@one_thread()
def calibrate(
    recordings: Sequence[Observed],
    options: CalibrationOptions,
    *,
    folder: Path,
    workers: int = 1,
    left_out: Sequence[Finding] = (),
    advance: Callable[[int], object] | None = None,
) -> Calibration:
    """Weighs the cloth of one flag.

    Args:
        recordings: of it, each cut to what is to be used.
        left_out: a warning for each recording of it that cannot be used.
        folder: where simulations are kept.
        workers: processes that simulate.
        advance: called with the seconds of flags that were simulated or found.

    Raises:
        InputError: see `Observed` and `designs_of`.
        RefusedError: see `answer_of`.
    """
    simulations: list[tuple[Observed, Mapping[str, FloatArray], FloatArray, Correction]] = []
    for recording, design in zip(recordings, designs_of(recordings, options), strict=True):
        readings = simulated_values(design, folder=folder, workers=workers, advance=advance)
        correction = measure_correction(
            design, readings, folder=folder, workers=workers, advance=advance
        )
        simulations.append((recording, design.values(), readings, correction))
    return answer_of(simulations, options, left_out=left_out)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Simulated:
    """A recording with its simulations.

    Attributes:
        values: name → (simulation,).
        summaries: (simulation, summary) with what numerics and pixels may add to them.
        used: (summary,) those that are weighed by.
    """

    observed: Observed
    values: Mapping[str, FloatArray]
    summaries: FloatArray
    used: BoolArray

    def rows(self, which: IntArray) -> _Simulated:
        """Returns it with some of the simulations."""
        values = {name: drawn[which] for name, drawn in self.values.items()}
        return replace(self, values=values, summaries=self.summaries[which])

    def sight(self, options: CalibrationOptions) -> Sight:
        """Returns it with an emulator fitted to the simulations.

        Raises:
            RefusedError: see `Emulator.fit`.
        """
        recording = self.observed
        return Sight(
            emulator=Emulator.fit(self.values, self.summaries, self.used, name=recording.name),
            azimuth=options.azimuth,
            elevation=options.elevation,
            place=recording.place,
        )


def answer_of(
    simulations: Sequence[tuple[Observed, Mapping[str, FloatArray], FloatArray, Correction]],
    options: CalibrationOptions,
    *,
    left_out: Sequence[Finding] = (),
) -> Calibration:
    """Returns the answer from recordings, each with its simulations' values, name → (simulation,),
    their readings (simulation, window, observable), and how far these lie from those of a finer
    mesh. Those whose simulations do not show what they show are left out.

    Args:
        left_out: a warning for each recording that is not among them.

    Raises:
        RefusedError: simulations show nothing of any recording, see `informative` and
            `Emulator.fit`.
        InputError: too little is left.
    """

    def seen(
        simulation: tuple[Observed, Mapping[str, FloatArray], FloatArray, Correction],
    ) -> tuple[_Simulated, Sight]:
        observed, values, readings, correction = simulation
        summaries = with_errors(observed, readings, correction, seed=options.seed)
        visible = np.tile(shown(observed.readings), 2 if observed.projection.changes else 1)
        used = informative(values, summaries, visible, name=observed.name)
        simulated = _Simulated(observed=observed, values=values, summaries=summaries, used=used)
        return simulated, simulated.sight(options)

    fitted, unshown = usable(simulations, seen, name=lambda simulation: simulation[0].name)
    left_out = (*left_out, *unshown)
    check_in_all([simulation.observed for simulation, _ in fitted], left_out=left_out)
    calibration = _answer_of(fitted, options, left_out=left_out)
    return _without_unlike(calibration, fitted, options, left_out=left_out)


def _without_unlike(
    calibration: Calibration,
    models: Sequence[tuple[_Simulated, Sight]],
    options: CalibrationOptions,
    *,
    left_out: Sequence[Finding],
) -> Calibration:
    """Returns the answer of those recordings that simulated flags look like, if there are such;
    otherwise the answer as it is, which then is withheld with the reason."""
    unlike = [recording for recording in calibration.recordings if recording.unlike is not None]
    like = [
        pair
        for pair, recording in zip(models, calibration.recordings, strict=True)
        if recording.unlike is None
    ]
    if not unlike or sum(pair.observed.duration for pair, _ in like) < LEAST_IN_ALL * WINDOW - 1e-9:
        return calibration
    warned = [
        Finding(kind=LEFT_OUT, severity=Severity.WARNING, what=_unlike(fitted), fix=_LOOK)
        for fitted in unlike
    ]
    again = _answer_of(like, options, left_out=(*left_out, *warned))
    return calibration if again.withheld is not None else again


def _answer_of(
    models: Sequence[tuple[_Simulated, Sight]],
    options: CalibrationOptions,
    *,
    left_out: Sequence[Finding],
) -> Calibration:
    """Returns the answer from recordings whose simulations show what they show."""
    simulations, sights = [simulation for simulation, _ in models], [sight for _, sight in models]
    draws = posterior(
        sights, [simulation.observed.summary for simulation in simulations], seed=options.seed
    )
    fitted = tuple(
        _fitted_values(simulation, sight, draws, number, options)
        for number, (simulation, sight) in enumerate(zip(simulations, sights, strict=True))
    )
    calibration = Calibration(
        options=options,
        draws=draws,
        recordings=fitted,
        check=check_coverage(simulations, options),
        cloth=_quantities(CLOTH, draws.cloth, options.level),
    )
    findings = (*left_out, *_findings(calibration))
    if calibration.withheld is not None:
        assumed = np.linspace(0.0, 1.0, 1001)
        prior = {q.name: q.at(assumed) for q in CLOTH}
        calibration = replace(calibration, cloth=_quantities(CLOTH, prior, options.level))
    return replace(calibration, findings=findings)


def quantity(about: Uncertain, draws: FloatArray, level: float) -> Quantity:
    """Returns what draws of the posterior say of a quantity."""
    assumed = about.at(np.array([(1 - level) / 2, (1 + level) / 2])).tolist()
    shares = np.linspace(0.0, 1.0, 1001)
    ranks = np.interp(draws, about.at(shares), shares)
    determined = float(ranks.std()) < DETERMINED / math.sqrt(12)
    # What is not determined has the prior's interval, which has no end where draws pile up.
    places = ranks if determined and about.ends is not None else None
    interval = span(
        draws, places, level=level, limits=about.limits, assumed=about.ends or about.limits
    )
    return Quantity(
        name=about.name,
        unit=about.unit,
        value=float(np.median(draws)) if determined and interval.estimated else None,
        sigma=float(draws.std()) if interval.estimated else None,
        span=interval,
        assumed=(assumed[0], assumed[1]),
        constrained=determined and (interval.estimated or interval.bound is not Bound.NOTHING),
    )


def _quantities(
    several: Sequence[Uncertain], draws: Mapping[str, FloatArray], level: float
) -> Mapping[str, Quantity]:
    return {about.name: quantity(about, draws[about.name], level) for about in several}


def check_coverage(recordings: Sequence[_Simulated], options: CalibrationOptions) -> Check:
    """Weighs simulations of all recordings together, an eighth at a time, by emulators fitted to
    the others; of the first recording alone where the others are of other cloths."""
    weights = [simulation.values[CLOTH[0].name] for simulation in recordings]
    recordings = [
        simulation
        for simulation, drawn in zip(recordings, weights, strict=True)
        if np.array_equal(drawn, weights[0])
    ]
    complete = np.flatnonzero(
        np.all(
            [
                np.isfinite(simulation.summaries[:, simulation.used]).all(axis=1)
                for simulation in recordings
            ],
            axis=0,
        )
    )
    rng = stream(options.seed, "calibrate", "check")
    chosen = rng.permutation(complete)[:_CHECKED]
    errors: list[float] = []
    contained = 0
    for fold in range(min(_FOLDS, len(chosen))):
        fold_members = chosen[fold::_FOLDS]
        rest = np.setdiff1d(np.arange(len(weights[0])), fold_members)
        sights = [simulation.rows(rest).sight(options) for simulation in recordings]
        seed = child_seed(options.seed, "check", fold)
        summaries = [simulation.summaries[fold_members] for simulation in recordings]
        weight = weigh_cloths(sights, summaries, seed=seed)[CLOTH[0].name]
        truth = weights[0][fold_members]
        low, middle, high = np.quantile(
            weight, [(1 - options.level) / 2, 0.5, (1 + options.level) / 2], axis=1
        )
        contained += int(((low <= truth) & (truth <= high)).sum())
        errors.extend(np.abs(middle / truth - 1).tolist())
    return Check(
        count=len(errors),
        held=contained,
        median_error=float(np.median(errors)) if errors else math.nan,
    )


def _uncertain_places(options: CalibrationOptions) -> tuple[Uncertain, ...]:
    return (*(q for q in NUISANCES if q.name == "gain"), options.azimuth, options.elevation)


def _fitted_values(
    simulated_recording: _Simulated,
    sight: Sight,
    posterior_draws: Posterior,
    index: int,
    options: CalibrationOptions,
) -> Fitted:
    """Returns what the emulator says that flags of the posterior show."""
    recording, summaries = simulated_recording.observed, simulated_recording.summaries
    values = {**posterior_draws.cloth, **posterior_draws.places[index]}
    predicted = sight.emulator.draw(values, seed=options.seed)
    used = sight.emulator.used
    count = len(OBSERVED)
    # What depends on nothing that is regressed on is that of simulations at random.
    rows = stream(options.seed, "calibrate", "rows").integers(len(summaries), size=len(predicted))
    # Replicates of the summary as the answer predicts it.
    replicates = np.where(np.isfinite(summaries), summaries, np.nanmean(summaries, axis=0))[rows]
    replicates[:, used] = predicted
    windows = recording.projection.at(replicates.reshape(len(predicted), -1, count))
    low, middle, high = np.quantile(
        windows, [(1 - options.level) / 2, 0.5, (1 + options.level) / 2], axis=0
    )
    compared = np.isfinite(recording.summary) & np.isfinite(replicates).all(axis=0)
    # The recording's distance among those of the replicates is the misfit.
    centre, inverse = (
        replicates[:, compared].mean(axis=0),
        np.linalg.pinv(np.cov(replicates[:, compared].T)),
    )
    offsets = np.concatenate([replicates[:, compared], recording.summary[None, compared]]) - centre
    *distances, distance_observed = ((offsets @ inverse) * offsets).sum(axis=1).tolist()
    distance = np.array(distances)
    spread = replicates.std(axis=0)
    deviations = np.where(
        compared & (spread > 0),
        (recording.summary - replicates.mean(axis=0)) / np.where(spread > 0, spread, 1.0),
        np.nan,
    )
    return Fitted(
        observed=recording,
        low=low,
        middle=middle,
        high=high,
        used=np.asarray(used.reshape(-1, count).any(axis=0)),
        misfit=float((1 + (distance >= distance_observed).sum()) / (1 + len(distance))),
        deviations=deviations,
        failed=int((~np.isfinite(summaries[:, used]).all(axis=1)).sum()),
        place=_quantities(_uncertain_places(options), posterior_draws.places[index], options.level),
    )


def _findings(calibration: Calibration) -> tuple[Finding, ...]:
    findings = list(constant_wind([recording.observed for recording in calibration.recordings]))
    for fitted in calibration.recordings:
        findings.extend(fitted.observed.findings)
        if fitted.unlike is not None:
            text = f"{_unlike(fitted)}. The weight is withheld"
            findings.append(Finding.of("unlike-simulations", text, fix=_LOOK))
        if fitted.failed > 0.1 * calibration.options.simulations:
            count = calibration.options.simulations
            text = f"{fitted.failed} of {count} simulations of {fitted.observed.name} were left out"
            findings.append(Finding.of("failed-simulations", text))
    if not calibration.draws.together:
        findings.append(TAKEN_APART)
    check, level = calibration.check, calibration.options.level
    if check.held < check.count * level - 2.6 * math.sqrt(check.count * level * (1 - level)):
        text = (
            f"of {check.count} simulations left out, the intervals of {check.held} contain "
            "the area weight, where "
            f"{check.count * level:.0f} are expected: they are too narrow"
        )
        fix = "give more simulations with --simulations"
        findings.append(Finding.of("narrow-intervals", text, fix=fix))
    findings.extend(_leaning(calibration))
    undetermined = [
        q.name.replace("_", " ") for q in calibration.cloth.values() if not q.constrained
    ]
    if undetermined:
        text = f"{', '.join(undetermined)}: the posterior is the prior's, so that no value is given"
        findings.append(Finding.of("not-determined", text))
    return tuple(findings)


def _unlike(recording: Fitted) -> str:
    """Returns what is unlike about a recording, and what may be the cause."""
    return (
        f"no simulated flag looks like {recording.observed.name} (p = {recording.misfit:.1g}): "
        f"{recording.unlike}. "
        "The cloth may not be "
        "separated from what is behind it, or its size, attachment or place be another than "
        "stated, or something may "
        "act on it that the model lacks"
    )


def _leaning(calibration: Calibration) -> list[Finding]:
    """Quantities of which only a bound is known."""
    findings = []
    for about in CLOTH:
        quantity = calibration.cloth[about.name]
        if not quantity.is_bound or about.ends is None:
            continue
        most = quantity.bound is Bound.MOST
        end = f"{about.ends[0 if most else 1]:.3g} {quantity.unit}"
        text = (
            f"{quantity.name.replace('_', ' ')}: {PILED:.0%} of the posterior or more lie within "
            f"{WITHIN:.0%} of the "
            f"end of what is assumed, {end}; {'less' if most else 'more'} would look the same, so "
            "that only a bound is "
            "given"
        )
        fix = "check the flag's size and where the camera stood" + (
            ", or weigh a piece of the cloth on a scale" if quantity is calibration.weight else ""
        )
        findings.append(Finding.of("leans-on-prior", text, fix=fix))
    return findings
