"""What a page says of a refinement: its answer, the trace of the search, and the film beside the
clips that were simulated, as in the paper's figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.answer import Figure, Gallery, Section, Table
from flagdata.answer.answer import Part
from flagdata.answer.charts import Across, Axis, Band, Chart, Colour, Dots, Line, Mark, Panel
from flagdata.core.arrays import UInt8Array
from flagdata.core.numbered import read_bounded
from flagdata.pages.page_pictures import moving, still
from measure.refine.evaluator import Evaluator
from measure.refine.refinement import METHOD, Refinement, phrase
from measure.refine.space import QUANTITIES, WIND_COLUMN
from measure.refine.target import Target
from measure.refine.trace import Trace

STEPS = (0, 10, 20, 40)
"""Steps that are shown: Runia et al. 2020, figure 8."""
SIDE = 200  # px of a frame on the page
_CLIPS = 10**9
"""Above the number of clips of any answer."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Shown:
    """A simulated frame.

    Attributes:
        step: evaluations before it; the nearest of those so far is shown.
        frame: (height, width) uint8; None where its simulation failed.
        wind: it was simulated with, of a flag of the simulated size [m/s].
        distance: of its clip to the target, squared.
    """

    step: int
    frame: UInt8Array | None
    wind: float
    distance: float


def frames(trace: Trace, evaluator: Evaluator, *, steps: Sequence[int] = STEPS) -> list[Shown]:
    """Selects the nearest simulated clip after each of some steps, by its middle frame; steps
    beyond the trace are left out."""
    nearest = []
    for step in steps:
        if step >= len(trace):
            continue
        index = trace.incumbent(evaluations=step + 1)
        point = trace.points[index]
        evaluated = evaluator.evaluate(point[None], 1)[0]
        wind = float(evaluator.simulator.space.values(point[None])[0, WIND_COLUMN])
        nearest.append(
            Shown(
                step=step, frame=evaluated.frame, wind=wind, distance=float(trace.distances[index])
            )
        )
    return nearest


def trace_chart(refinement: Refinement, clip: int = 0) -> Chart:
    """Charts distance and wind over evaluations: the paper's figure 8, with intervals and the
    floor."""
    trace, target = refinement.traces[clip], refinement.targets[clip]
    number = np.arange(1.0, len(trace) + 1)
    distance = Panel(
        marks=[
            Dots(
                x=number,
                y=trace.distances,
                colour=Colour.QUIET,
                size=3.0,
                label="simulated clip",
            ),
            Line(x=number, y=trace.distances[trace.best], label="nearest, or median of the wind"),
            Across(y=refinement.floor, colour=Colour.LOG, dashed=True, label="noise floor"),
        ],
        x=Axis(label="evaluations"),
        y=Axis(label="squared distance to the target", logarithmic=True),
    )
    space, root = refinement.evaluators[clip].simulator.space, math.sqrt(refinement.scale)
    least, most = root * space.wind.low, root * space.wind.high
    evaluated = root * space.values(trace.points)[:, WIND_COLUMN]
    marks: list[Mark] = [Dots(x=number, y=evaluated, colour=Colour.QUIET, size=3.0)]
    if clip == 0:
        count = [one.evaluations for one in refinement.rounds]
        rounds = [one.intervals[0] for one in refinement.rounds]
        low, high = np.clip([one.interval for one in rounds], least, most).T
        medians = [math.nan if one.value is None else one.value for one in rounds]
        level = f"interval at {100 * refinement.level:.0f} %"
        marks += [
            Band(x=count, low=low, high=high, opacity=0.25, label=level),
            Line(x=count, y=medians, marker="o"),
        ]
    if "wind_speed" in target.truth:
        wind = target.truth["wind_speed"]
        marks.append(Across(y=wind, colour=Colour.INK, dashed=True, label="true wind"))
    wind_panel = Panel(
        marks=marks,
        x=Axis(label="evaluations"),
        y=Axis(label="wind speed [m/s]", limits=(least, most)),
    )
    return Chart(rows=[[distance, wind_panel]])


def refinement_section(refinement: Refinement, *, in_motion: bool = True) -> Section:
    """Makes the section of what a refinement found, with its trace and pictures.

    Args:
        in_motion: whether the nearest simulated clip plays beside the target; it is simulated once
            more for that.
    """
    parts: list[Part] = [
        f"{refinement.sentence[:1].upper()}{refinement.sentence[1:]}.",
        f"{METHOD} It ended because {refinement.stopped}.",
        _quantities(refinement),
    ]
    for number, (target, trace, evaluator) in enumerate(
        zip(refinement.targets, refinement.traces, refinement.evaluators, strict=True)
    ):
        chart = trace_chart(refinement, number)
        title = "Distance to the target and wind speed over evaluations"
        parts += [
            f"{target.name}:",
            Figure(title=title, content=chart),
            _gallery(refinement, target, trace, evaluator, in_motion=in_motion),
        ]
    spent = ", ".join(f"{stage} {seconds:.0f} s" for stage, seconds in refinement.seconds.items())
    effort = (
        f"{refinement.evaluations} clips were simulated for each target; replicates of one cloth "
        f"and wind are {refinement.floor:.3g} from each other (median squared distance), and the "
        f"cloth's posterior rests on {refinement.posterior.effective:.0f} effective draws of its "
        f"prior. Time: {spent}."
    )
    parts += [
        _bending(refinement),
        effort,
    ]
    if refinement.findings:
        parts.insert(3, refinement.findings)
    return Section(title="Refined by simulation", parts=parts, anchor="refinement", folded=True)


def _gallery(
    refinement: Refinement,
    target: Target,
    trace: Trace,
    evaluator: Evaluator,
    *,
    in_motion: bool,
) -> Gallery:
    """Shows the target beside the nearest clips after some steps, and both in motion."""
    nearest = evaluator.clip(trace.points[trace.incumbent()]) if in_motion else None
    rate = evaluator.estimator.front_end.rate
    figures = [
        Figure(
            title="Target",
            content=still(target.clip[len(target.clip) // 2], side=SIDE),
            caption="target",
            width=SIDE,
        )
    ]
    for shown in frames(trace, evaluator, steps=STEPS):
        wind = math.sqrt(refinement.scale) * shown.wind
        failed = "" if shown.frame is not None else " (the simulation failed)"
        figures.append(
            Figure(
                title=f"Simulated, step {shown.step}",
                content="" if shown.frame is None else still(shown.frame, side=SIDE),
                caption=f"step {shown.step}: {wind:.2f} m/s, distance {shown.distance:.3g}{failed}",
                width=SIDE,
            )
        )
    if nearest is not None:
        figures += [
            Figure(
                title=f"{title} in motion",
                content=moving(clip, rate=rate, side=SIDE),
                caption=title,
                width=SIDE,
            )
            for title, clip in (("target", target.clip), ("nearest simulation", nearest))
        ]
    return Gallery(figures=figures)


def _quantities(refinement: Refinement) -> Table:
    """Tabulates the quantities: refined and, where the network estimates it, amortised."""
    about = {quantity.name: quantity for quantity in QUANTITIES}
    before = {entry.name: entry for entry in refinement.amortised}
    rows = []
    for entry in refinement.intervals:
        name, _, clip = entry.name.partition(".")
        quantity, number = about[name], read_bounded(clip, most=_CLIPS)
        note = "the clip hardly narrows the prior" if entry.prior_share > 0.9 else ""
        of_network = before.get(entry.name)
        rows.append(
            [
                quantity.about + (f", clip {number + 1}" if number is not None else ""),
                phrase(entry, quantity.digits),
                "" if of_network is None else phrase(of_network, quantity.digits),
                "" if quantity.unit == "1" else quantity.unit,
                note,
            ]
        )
    refined = f"refined, {100 * refinement.level:.0f} %"
    columns = ["quantity", refined, "before, by the network alone", "unit", ""]
    return Table(columns=columns, rows=rows)


def _bending(refinement: Refinement) -> Table:
    rows = [
        [str(number), *(f"{value:.2e}" for value in row)]
        for number, row in enumerate(refinement.bending.tolist())
    ]
    return Table(
        columns=["bending coefficient", "median [N·m]", "low", "high"],
        rows=rows,
        caption="Coefficients 0 to 4 are edges at 0° in the cloth, 5 to 9 at 45°, 10 to 14 at 90°, "
        "each at five curvatures. Single ones can hardly be separated: their intervals are mostly "
        "the prior's.",
    )
