"""The refinement's section of a report: a fragment of HTML for any page of `flagdata.pages`."""

from __future__ import annotations

from markupsafe import Markup

from flagdata.pages.pictures import moving, still
from flagdata.pages.render import render
from measure.refine.pictures import SIDE, STEPS, frames, trace_picture
from measure.refine.refinement import METHOD, Refinement
from measure.refine.space import QUANTITIES


def section(refinement: Refinement, *, in_motion: bool = True) -> Markup:
    """What a refinement found, with its trace and pictures; the page gives it a heading.

    Args:
        in_motion: whether the nearest simulated clip plays beside the target; it is simulated once more for that.
    """
    clips = []
    for number, (target, trace, evaluator) in enumerate(
        zip(refinement.targets, refinement.traces, refinement.evaluators, strict=True)
    ):
        shown = frames(trace, evaluator, steps=STEPS)
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
                        "wind": f"{s.wind:.2f}",
                        "distance": f"{s.distance:.3g}",
                    }
                    for s in shown
                ],
                "motion": nearest is not None
                and [moving(clip, rate=rate, side=SIDE) for clip in (target.clip, nearest)],
            }
        )
    found = render(
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
    return Markup(found)


def _rows(refinement: Refinement) -> list[dict[str, str]]:
    """The table of quantities: refined and, where the network estimates it, amortised."""
    about = {quantity.name: quantity for quantity in QUANTITIES}
    before = {entry.name: entry for entry in refinement.amortised}
    rows = []
    for entry in refinement.intervals:
        name, _, clip = entry.name.partition(".")
        quantity = about[name]
        note = "the clip hardly narrows the prior" if entry.prior_share > 0.9 else ""
        rows.append(
            {
                "about": quantity.about + (f", clip {int(clip) + 1}" if clip else ""),
                "unit": quantity.unit,
                "refined": entry.phrase(quantity.digits),
                "note": note,
                "amortised": before[entry.name].phrase(quantity.digits) if entry.name in before else "",
            }
        )
    return rows
