"""The refinement's section of a report: a fragment of HTML for any page of `flagdata.pages`.

Pictures of a refinement, as in the paper's figures: the trace, and the target beside simulated
clips.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from flagdata.core.arrays import UInt8Array
from flagdata.core.numbered import read_bounded
from flagdata.pages.page_pictures import figure_url, moving, still
from flagdata.pages.render import render
from measure.refine.evaluator import Evaluator
from measure.refine.refinement import METHOD, Refinement
from measure.refine.space import QUANTITIES, WIND_COLUMN
from measure.refine.trace import Trace

STEPS = (0, 10, 20, 40)
"""Steps that are shown: Runia et al. 2020, figure 8."""
SIDE = 200  # px of a frame on the page
_CLIPS = 10**9
"""Above the number of clips of any answer."""
_OWN, _TARGET, _OTHER = "#c4622d", "#2b6f8f", "#7a7a7a"


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


def trace_picture(refinement: Refinement, clip: int = 0) -> str:
    """Draws distance and wind over evaluations, as a PNG in a data URL: the paper's figure 8,
    intervals, the floor."""
    trace, target = refinement.traces[clip], refinement.targets[clip]
    figure = Figure(figsize=(9.5, 3.1), layout="constrained")
    distance_axes, wind_axes = figure.subplots(1, 2)
    number = np.arange(1, len(trace) + 1)
    distance_axes.semilogy(
        number, trace.distances, ".", color=_OTHER, markersize=4, label="simulated clip"
    )
    distance_axes.semilogy(
        number, trace.distances[trace.best], color=_OWN, linewidth=1.4, label="nearest so far"
    )
    distance_axes.axhline(
        refinement.floor, color=_TARGET, linewidth=1.0, linestyle="--", label="noise floor"
    )
    distance_axes.set(xlabel="evaluations", ylabel="squared distance to the target")
    distance_axes.legend(fontsize=8)
    space, root = refinement.evaluators[clip].simulator.space, math.sqrt(refinement.scale)
    least, most = root * space.wind.low, root * space.wind.high
    evaluated = root * space.values(trace.points)[:, WIND_COLUMN]
    wind_axes.plot(number, evaluated, ".", color=_OTHER, markersize=4, label="evaluated")
    if clip == 0:
        count = [r.evaluations for r in refinement.rounds]
        winds = [r.intervals[0] for r in refinement.rounds]
        wind_axes.fill_between(
            count,
            *np.clip([(w.span.low, w.span.high) for w in winds], least, most).T,
            color=_OWN,
            alpha=0.25,
            linewidth=0,
            label=f"{refinement.level:.0%} interval",
        )
        wind_axes.plot(
            count,
            [np.nan if w.median is None else w.median for w in winds],
            color=_OWN,
            linewidth=1.4,
            marker="o",
            markersize=3,
            label="median",
        )
    if "wind_speed" in target.truth:
        wind_axes.axhline(
            target.truth["wind_speed"],
            color=_TARGET,
            linewidth=1.0,
            linestyle="--",
            label="true wind",
        )
    wind_axes.set(xlabel="evaluations", ylabel="wind speed [m/s]", ylim=(least, most))
    wind_axes.legend(fontsize=8)
    return figure_url(figure, dpi=130)


def section(refinement: Refinement, *, in_motion: bool = True) -> Markup:
    """Renders what a refinement found, with its trace and pictures; the page gives it a heading.

    Args:
        in_motion: whether the nearest simulated clip plays beside the target; it is simulated once
            more for that.
    """
    clips = []
    for number, (target, trace, evaluator) in enumerate(
        zip(refinement.targets, refinement.traces, refinement.evaluators, strict=True)
    ):
        frames_shown = frames(trace, evaluator, steps=STEPS)
        nearest = evaluator.clip(trace.points[trace.incumbent()]) if in_motion else None
        rate = evaluator.estimator.front_end.rate
        clips.append(
            {
                "name": target.name,
                "trace": trace_picture(refinement, number),
                "target": still(target.clip[len(target.clip) // 2], side=SIDE),
                "frames": [
                    {
                        "picture": None if s.frame is None else still(s.frame, side=SIDE),
                        "step": s.step,
                        "wind": f"{math.sqrt(refinement.scale) * s.wind:.2f}",
                        "distance": f"{s.distance:.3g}",
                    }
                    for s in frames_shown
                ],
                "motion": nearest is not None
                and [moving(clip, rate=rate, side=SIDE) for clip in (target.clip, nearest)],
            }
        )
    html = render(
        "measure.refine",
        "section.html.j2",
        {
            "sentence": refinement.sentence,
            "method": METHOD,
            "stopped": refinement.stopped,
            "level": refinement.level,
            "rows": _rows(refinement),
            "clips": clips,
            "findings": refinement.findings,
            "bending": [[f"{value:.2e}" for value in row] for row in refinement.bending.tolist()],
            "floor": f"{refinement.floor:.3g}",
            "evaluations": refinement.evaluations,
            "effective": f"{refinement.posterior.effective:.0f}",
            "seconds": refinement.seconds,
        },
    )
    return Markup(html)


def _rows(refinement: Refinement) -> list[dict[str, str]]:
    """Tabulates the quantities: refined and, where the network estimates it, amortised."""
    about = {quantity.name: quantity for quantity in QUANTITIES}
    before = {entry.name: entry for entry in refinement.amortised}
    rows = []
    for entry in refinement.intervals:
        name, _, clip = entry.name.partition(".")
        quantity, number = about[name], read_bounded(clip, most=_CLIPS)
        note = "the clip hardly narrows the prior" if entry.prior_share > 0.9 else ""
        rows.append(
            {
                "about": quantity.about + (f", clip {number + 1}" if number is not None else ""),
                "unit": quantity.unit,
                "refined": entry.phrase(quantity.digits),
                "note": note,
                "amortised": before[entry.name].phrase(quantity.digits)
                if entry.name in before
                else "",
            }
        )
    return rows
