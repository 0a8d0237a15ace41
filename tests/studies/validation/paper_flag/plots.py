"""The report's pictures, drawn from measured and simulated numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from tests.studies.validation.paper_flag.candidates import Candidate, Shear
from tests.studies.validation.paper_flag.evidence import Condition, Kind, factor_that_meets
from tests.studies.validation.paper_flag.limit_cycle import as_columns
from tests.studies.validation.paper_flag.observe import Clip, Observations, median_by_length
from tests.studies.validation.paper_flag.recipe import Case, Group
from tests.studies.validation.paper_flag.simulated import SimulatedTable
from tests.studies.validation.paper_flag.study import IN_TIME, Outcome, Study
from tests.studies.validation.paper_flag.waves import waves

_COLOURS = {
    Candidate.REACTIVE: "#1f6f9c",
    Candidate.LIFT: "#b4531a",
    Candidate.REACTIVE_AND_LIFT: "#7a4a9a",
}
_INK, _QUIET = "#1c2326", "#8a969c"
_MET = 0.03  # of a mean log error: half again the step of the factors


def lines(case: Case, clip: Clip, study: Study) -> Figure:
    """The sheet over one cycle: as filmed, and as each model in time moves at the same tunnel
    speed."""
    panels: list[tuple[str, str, list[tuple[FloatArray, FloatArray]]]] = [
        (
            f"filmed, {clip.spec.speed:g} m/s",
            _INK,
            [(clip.waves.columns, line) for line in clip.lines],
        )
    ]
    for candidate, motion in study.shapes.items():
        model = _free(study, candidate)
        speed = model.factor * clip.spec.speed
        step = max(
            1,
            round(1 / clip.waves.frequency.value / 16 * len(motion.time) / float(motion.time[-1])),
        )
        shown = range(len(motion.time) - 16 * step, len(motion.time), step)
        drawn = [(motion.along[frame, :, 0], motion.across[frame, :, 0]) for frame in shown]
        panels.append(
            (
                f"{candidate.value}\n{model.load}, {speed:.2g} m/s at the sheet",
                _COLOURS[candidate],
                drawn,
            )
        )
    figure = Figure(figsize=(3.1 * len(panels), 3.3), layout="constrained")
    for axes, (title, colour, drawn) in zip(
        np.ravel(figure.subplots(1, len(panels), sharey=True)), panels, strict=True
    ):
        for along, across in drawn:
            axes.plot(1e3 * along, 1e3 * across, color=colour, lw=0.8, alpha=0.75)
        axes.set_title(title, fontsize=8.5)
        axes.set(aspect="equal", xlim=(0, 145), ylim=(-65, 65), xlabel="from the clamp [mm]")
    return figure


def _free(study: Study, candidate: Candidate) -> Outcome:
    return next(o for o in study.in_time if o.candidate is candidate and o.shear is Shear.FREE)


def speeds(case: Case, seen: Observations, study: Study) -> Figure:
    """Frequency, wave speed and amplitude over the tunnel's speed: measured, and by the models in
    time."""
    figure = Figure(figsize=(12, 4.2), layout="constrained")
    tunnel = np.linspace(6.5, 12.8, 64)
    kinds = (Kind.FREQUENCY, Kind.WAVE, Kind.AMPLITUDE)
    labels = ("frequency [Hz]", "speed of the wave [m/s]", "largest first harmonic / L")
    for axes, kind, label in zip(np.ravel(figure.subplots(1, 3)), kinds, labels, strict=True):
        for candidate in IN_TIME:
            model = _free(study, candidate)
            table = study.tables[candidate]
            curve = table.curve(kind, table.loads.index(model.load), model.factor * tunnel)
            axes.plot(
                tunnel,
                curve,
                color=_COLOURS[candidate],
                lw=1.3,
                label=f"{candidate.value}, s = {model.factor:.2f}",
            )
        for group, face, name in (
            (Group.FIT, _INK, "fitted to"),
            (Group.HELD_OUT, "white", "held out"),
        ):
            judged = "not fitted to" if kind is not Kind.FREQUENCY else name
            _points(axes, seen.conditions(case, group, (kind,)), face=face, label=judged)
        if kind is Kind.FREQUENCY:
            others = seen.conditions(case, Group.OTHER, (kind,))
            axes.plot(
                [c.at for c in others],
                [c.value for c in others],
                "x",
                color=_QUIET,
                label="segmented edges",
            )
        axes.set(xlabel="speed of the tunnel [m/s]", ylabel=label, ylim=(0, None))
    figure.axes[0].legend(frameon=False, fontsize=7.5)
    return figure


def _points(axes: Axes, conditions: Sequence[Condition], *, face: str, label: str) -> None:
    for condition in conditions:
        if np.isfinite(condition.low):
            axes.plot([condition.at] * 2, [condition.low, condition.high], color=_INK, lw=1)
    axes.plot(
        [c.at for c in conditions],
        [c.value for c in conditions],
        "o",
        color=_INK,
        mfc=face,
        ms=5,
        label=label,
    )


def along(seen: Observations, study: Study, case: Case) -> Figure:
    """Amplitude and phase along the stream, of the clips that show the whole sheet and of the
    models in time."""
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    size, phase = np.ravel(figure.subplots(1, 2))
    for clip, style in zip([c for c in seen.clips if c.spec.whole], ("-", "--"), strict=False):
        _profile(
            size,
            phase,
            clip.waves.columns,
            clip.waves.profile,
            _INK,
            style,
            f"filmed, {clip.spec.speed:g} m/s",
        )
    columns = np.linspace(0.04, 1.0, 90) * case.sheet.length
    for candidate, motion in study.shapes.items():
        found = waves(motion.time, columns, as_columns(motion, 0, columns))
        _profile(
            size, phase, found.columns, found.profile, _COLOURS[candidate], "-", candidate.value
        )
    size.set(xlabel="from the clamp [mm]", ylabel="first harmonic [mm]")
    phase.set(xlabel="from the clamp [mm]", ylabel="phase [rad]; falling: towards the tip")
    size.legend(frameon=False, fontsize=8)
    return figure


def _profile(
    size: Axes,
    phase: Axes,
    columns: FloatArray,
    profile: NDArray[np.complex128],
    colour: str,
    style: str,
    label: str,
) -> None:
    size.plot(1e3 * columns, 1e3 * np.abs(profile), style, color=colour, lw=1.2, label=label)
    moving = np.abs(profile) > 0.08 * np.abs(profile).max()
    turned = np.unwrap(np.angle(profile[moving]))
    phase.plot(1e3 * columns[moving], turned - turned[-1], style, color=colour, lw=1.2)


def lengths(case: Case, seen: Observations, study: Study) -> Figure:
    """Speeds at which flutter stops and starts over the sheet's length, with the models and the
    published theory."""
    figure = Figure(figsize=(12, 4.6), layout="constrained")
    tunnel, theory = np.ravel(figure.subplots(1, 2))
    every = np.array(sorted({*case.fit_lengths, *case.held_out_lengths}))
    thresholds = seen.thresholds
    for axes in (tunnel, theory):
        for rows, marker, label in (
            (thresholds.stop, "v", "stops (single runs)"),
            (thresholds.onset, "^", "starts (single runs)"),
        ):
            axes.plot(
                [1e3 * t.length for t in rows],
                [t.speed for t in rows],
                marker,
                color=_QUIET,
                ms=4,
                mfc="none",
                label=label,
            )
        for rows, marker, label in (
            (thresholds.bistable, "s", "authors' bistable threshold"),
            (thresholds.flutter, "D", "authors' flutter threshold"),
        ):
            axes.plot(
                [1e3 * t.length for t in rows],
                [t.speed for t in rows],
                marker,
                color=_INK,
                ms=4,
                mfc="none",
                label=label,
            )
        axes.set(xlabel="length [mm]", ylim=(0, 36))
    stops = np.array(median_by_length(thresholds.stop))
    tunnel.plot(1e3 * stops[:, 0], stops[:, 1], "v", color=_INK, ms=6, label="stops (median)")
    for candidate in (Candidate.REACTIVE, Candidate.LIFT, Candidate.REACTIVE_AND_LIFT):
        model = next(o for o in study.linear if o.candidate is candidate and o.shear is Shear.FREE)
        table = study.linear_tables[candidate]
        row = table.loads.index(model.load)
        one = np.array([model.factor])
        values = [
            table.predict(row, one, Condition(kind=Kind.STOP, at=float(h), value=1.0))[0]
            for h in every
        ]
        tunnel.plot(
            1e3 * every,
            values,
            "-",
            color=_COLOURS[candidate],
            lw=1.3,
            label=f"{candidate.value}: {model.load}, s = {model.factor:.2f}",
        )
    _published(theory, case, thresholds.curves)
    tunnel.set(ylabel="speed of the tunnel [m/s]", title="thresholds and fitted models")
    theory.set(title="thresholds and the theory of Argentina and Mahadevan")
    tunnel.legend(frameon=False, fontsize=7.5)
    theory.legend(frameon=False, fontsize=7.5)
    return figure


def _published(axes: Axes, case: Case, curves: Mapping[str, Sequence[tuple[float, float]]]) -> None:
    """The digitised curves, for this sheet at each length, at the logged speed and at the declared
    share of it."""
    sheet, density = case.sheet, case.density
    for name, pairs in curves.items():
        if name == "experiments":
            continue
        points = np.log(np.array(sorted(pairs)).T)
        length = np.geomspace(0.055, 0.165, 60)
        ratio = np.log(density * length / sheet.mass)
        reduced = np.exp(np.interp(ratio, points[0], points[1], left=np.nan, right=np.nan))
        speed = reduced * np.sqrt(sheet.rigidity / (density * length**3))
        first = name.endswith("00")
        axes.plot(
            1e3 * length,
            speed,
            "-",
            color="#3b7d6b",
            lw=1,
            label="their curves, logged speed" if first else None,
        )
        axes.plot(
            1e3 * length,
            speed / case.shear_factor,
            ":",
            color="#3b7d6b",
            lw=1.2,
            label=f"their curves, {case.shear_factor:g} of it at the sheet" if first else None,
        )


def plane(case: Case, seen: Observations, table: SimulatedTable) -> Figure:
    """Where each kind of measurement is met on average, over the reactive mass and the factor s."""
    figure = Figure(figsize=(6.4, 4.6), layout="constrained")
    (axes,) = np.ravel(figure.subplots(1, 1, squeeze=False))
    strengths = [load.reactive for load in table.loads]
    colours = {
        Kind.FREQUENCY: "#1f6f9c",
        Kind.WAVE: "#3b7d6b",
        Kind.AMPLITUDE: "#7a4a9a",
        Kind.STOP: "#b4531a",
    }
    for kind, colour in colours.items():
        conditions = [
            c for g in (Group.FIT, Group.HELD_OUT) for c in seen.conditions(case, g, (kind,))
        ]
        met = [
            factor_that_meets(table, row, conditions, within=_MET)
            for row in range(len(table.loads))
        ]
        axes.plot(strengths, met, "o-", color=colour, ms=3.5, lw=1.3, label=kind.value)
    axes.axhline(case.shear_factor, color=_QUIET, lw=0.8, ls=":")
    axes.axvline(case.reactive_share, color=_QUIET, lw=0.8, ls=":")
    axes.set(xlabel="M / (ρ L)", ylabel="s that meets it", xscale="log", ylim=(0.25, 1.3))
    axes.legend(frameon=False, fontsize=8, title="mean log error 0 for")
    return figure
