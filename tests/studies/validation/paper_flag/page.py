"""The report of a case: one HTML file that refers to no other, and the same as JSON values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from flagdata.core.provenance import code_version
from flagdata.pages.page_pictures import data_url
from flagdata.pages.render import render
from tests.studies.figure_bytes import png
from tests.studies.validation.paper_flag import plots
from tests.studies.validation.paper_flag.candidates import Candidate, Shear
from tests.studies.validation.paper_flag.evidence import NEVER, Kind
from tests.studies.validation.paper_flag.observe import Clip, Observations
from tests.studies.validation.paper_flag.recipe import Case, Group
from tests.studies.validation.paper_flag.study import Cell, Outcome, Study
from tests.studies.validation.paper_flag.verdict import Verdict
from tests.studies.validation.paper_flag.words import candidates_tried, verdict_words

_PICTURES = ("lines", "along", "lengths", "speeds", "plane")


def page(case: Case, seen: Observations, study: Study, verdict: Verdict) -> str:
    """The report, with its pictures inside."""
    figures = (
        plots.lines(case, _whole_held_out(case, seen), study),
        plots.along(seen, study, case),
        plots.lengths(case, seen, study),
        plots.speeds(case, seen, study),
        plots.plane(case, seen, study.tables[Candidate.REACTIVE]),
    )
    values = {
        "case": case,
        "verdict": verdict,
        "words": verdict_words(seen, study, verdict),
        "images": {
            name: data_url(png(figure), "image/png")
            for name, figure in zip(_PICTURES, figures, strict=True)
        },
        "clips": [_clip_row(clip, case) for clip in seen.clips],
        "stretches": [(c.spec.name, c.stretch) for c in seen.clips if c.stretch is not None],
        "far": _far(case, seen),
        "declared": [_declared_row(cell) for cell in study.declared],
        "fit_speeds": _listed(c.speed for c in case.of(Group.FIT)),
        "held_speeds": _listed(c.speed for c in case.of(Group.HELD_OUT)),
        "fit_lengths": _listed(1e3 * h for h in case.fit_lengths),
        "held_lengths": _listed(1e3 * h for h in case.held_out_lengths),
        "linear": [_model_row(o) for o in study.linear],
        "crossed": [_model_row(o) for o in study.crossed],
        "in_time": [_model_row(o) for o in study.in_time],
        "floor": {kind.value: 100 * value for kind, value in study.floor.items()},
        "candidates_tried": candidates_tried(study, verdict),
        "version": f"flagdata {code_version()}",
    }
    return render("tests.studies.validation.paper_flag", "page.html.j2", values)


def as_json(case: Case, seen: Observations, study: Study, verdict: Verdict) -> dict[str, Any]:
    """Everything on the page, as JSON values; errors are natural logarithms, None where a model has
    no flutter."""
    return {
        "case": case.name,
        "seed": case.seed,
        "code_version": code_version(),
        "conclusion": verdict.conclusion.value,
        "words": verdict_words(seen, study, verdict),
        "clips": [
            {
                "name": clip.spec.name,
                "tunnel_speed": clip.spec.speed,
                "group": clip.spec.group.value,
                "whole_sheet": clip.spec.whole,
                "frames": clip.frames,
                "columns": {what.name.lower(): share for what, share in clip.shares.items()},
                "height_error_px": clip.scatter,
                "frequency_hz": clip.waves.frequency.as_dict(),
                "explained": clip.waves.explained,
                "wave_speed_m_s": clip.waves.speed.as_dict() if clip.spec.whole else None,
                "amplitude_m": clip.waves.amplitude.as_dict() if clip.spec.whole else None,
                "two_modes": _number(clip.waves.two_modes),
                "travelling": clip.waves.travelling,
                "stretch": asdict(clip.stretch) if clip.stretch else None,
            }
            for clip in seen.clips
        ],
        "declared": [
            {
                "load": str(c.load),
                "factor": c.factor,
                "errors": {k.value: _errors(v) for k, v in c.errors.items()},
                "tip_travel": {f"{speed:g}": _number(tip) for speed, tip in c.tips.items()},
            }
            for c in study.declared
        ],
        "linear": [_outcome(o) for o in study.linear],
        "crossed": [_outcome(o) for o in study.crossed],
        "in_time": [_outcome(o) for o in study.in_time],
        "floor": {kind.value: _number(value) for kind, value in study.floor.items()},
        "tolerance": {kind.value: _number(value) for kind, value in verdict.tolerance.items()},
        "insufficient": {kind.value: value for kind, value in verdict.insufficient.items()},
        "remaining": [model_name(o) for o in verdict.remaining],
        "remaining_by_what_was_fitted": [model_name(o) for o in verdict.remaining_fitted],
    }


def model_name(outcome: Outcome) -> str:
    """The candidate, and the speed it is in."""
    return (
        f"{outcome.candidate.value}, {'s free' if outcome.shear is Shear.FREE else 'logged speed'}"
    )


def _outcome(o: Outcome) -> dict[str, Any]:
    return {
        "model": model_name(o),
        "fitted_to": [k.value for k in o.fitted_to],
        "load": str(o.load),
        "strengths": asdict(o.load),
        "factor": o.factor,
        "factor_range": list(o.factors),
        "fit_errors": {k.value: _errors(v) for k, v in o.fit.items()},
        "held_out_errors": {k.value: _errors(v) for k, v in o.held_out.items()},
        "gain_over_base": {k.value: v.as_dict() for k, v in o.gains.items()},
        "segmented_sheets_errors": _errors(o.others),
    }


def _errors(values: Sequence[float] | np.ndarray[Any, Any]) -> list[float | None]:
    return [None if float(v) == NEVER else float(v) for v in values]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _percent(logarithm: float) -> float | None:
    """An error as a percentage of what was measured; None for a model without flutter."""
    return None if logarithm == NEVER else 100 * (math.exp(logarithm) - 1)


def _mean(values: np.ndarray[Any, Any]) -> str:
    none = int((values == NEVER).sum())
    if none == len(values):
        return "no flutter"
    error = f"{100 * (math.exp(float(np.abs(values[values != NEVER]).mean())) - 1):.0f} %"
    return f"{error}, {none} without" if none else error


def _model_row(o: Outcome) -> dict[str, Any]:
    low, high = o.factors
    factor = "1" if o.shear is Shear.LOGGED else f"{o.factor:.2f} [{low:.2f}, {high:.2f}]"
    flutters = not all((values == NEVER).all() for values in o.fit.values())
    gains = {
        kind.value: f"{_times(gain.mean)} [{_times(gain.low)}, {_times(gain.high)}]"
        for kind, gain in o.gains.items()
    }
    return {
        "name": model_name(o),
        "load": str(o.load) if flutters else "any",
        "factor": factor if flutters else "any",
        "mean": {kind.value: _mean(values) for kind, values in o.held_out.items()},
        "each": {
            kind.value: [_percent(float(v)) for v in values] for kind, values in o.held_out.items()
        },
        "gain": gains,
        "flutters": flutters,
        "others": _mean(o.others),
    }


def _times(gain: float) -> str:
    """A difference of logarithms as a factor."""
    return f"×{math.exp(gain):.1f}"


def _clip_row(clip: Clip, case: Case) -> list[str]:
    w, f = clip.waves, clip.waves.frequency
    whole = clip.spec.whole
    interval = (
        f" [{f.low:.2f}, {f.high:.2f}], n = {f.count}"
        if math.isfinite(f.low)
        else ", too few cycles"
    )
    return [
        clip.spec.name,
        f"{clip.spec.speed:g}",
        clip.spec.group.value,
        "whole sheet" if whole else "trailing part",
        f"{100 * clip.shares[next(iter(clip.shares))]:.0f} %",
        f"{clip.scatter:.2f}",
        f"{f.value:.2f}{interval}",
        f"{100 * w.explained:.0f} %",
        f"{w.speed.value:.2f} [{w.speed.low:.2f}, {w.speed.high:.2f}]"
        if whole
        else "scale unknown",
        f"{w.amplitude.value / case.sheet.length:.3f}" if whole else "scale unknown",
    ]


def _declared_row(cell: Cell) -> list[str]:
    def ratio(values: np.ndarray[Any, Any]) -> str:
        if (values == NEVER).all():
            return "no flutter"
        ratios = np.exp(values[values != NEVER])
        return f"{ratios.min():.2f} to {ratios.max():.2f}"

    tips = [tip for tip in cell.tips.values() if math.isfinite(tip)]
    lost = len(cell.tips) - len(tips)
    travel = f"{min(tips):.3f} to {max(tips):.3f}" if tips else ""
    return [
        "base model" if not cell.load.reactive else f"reactive loading, {cell.load}",
        "tunnel's" if cell.factor == 1 else f"{cell.factor:g} of the tunnel's",
        ratio(cell.errors[Kind.FREQUENCY]),
        ratio(cell.errors[Kind.STOP]),
        "; ".join(part for part in (travel, f"{lost} diverged" if lost else "") if part),
    ]


def _far(case: Case, seen: Observations) -> dict[str, str]:
    """The tip's travel along the stream: of the clip without a clamp in which it is widest, and of
    a whole sheet's."""
    far = max((c for c in seen.clips if not c.spec.whole), key=lambda c: c.tip[2] - c.tip[0])
    near = _whole_held_out(case, seen)
    span = far.tip[2] - far.tip[0]
    return {
        "whole": _listed(c.spec.speed for c in seen.clips if c.spec.whole),
        "speed": f"{far.spec.speed:g}",
        "span": f"{span:.0f}",
        "share": f"{100 * case.column_scale * span / case.sheet.length:.0f}",
        "near_span": f"{near.tip[2] - near.tip[0]:.0f}",
        "near_speed": f"{near.spec.speed:g}",
    }


def _listed(values: Any) -> str:
    return ", ".join(f"{value:.4g}" for value in values)


def _whole_held_out(case: Case, seen: Observations) -> Clip:
    name = next(clip.name for clip in case.of(Group.HELD_OUT) if clip.whole)
    return next(clip for clip in seen.clips if clip.spec.name == name)
