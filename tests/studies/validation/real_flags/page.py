"""The page and the picture of the case, from the study's figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from flagdata.answer.markdown import table
from flagdata.core.arrays import FloatArray
from tests.studies.validation.paper_flag.recipe import Group
from tests.studies.validation.real_flags.paper import Paper, measured
from tests.studies.validation.real_flags.published import PUBLISHED, Published, Role, label
from tests.studies.validation.real_flags.runs import READINGS
from tests.studies.validation.real_flags.study import (
    CANDIDATES,
    NAMED,
    PROBED,
    VARIANTS,
    Fit,
    Predictions,
    judged,
    misfit,
    misfits,
    with_errors,
)

_BASE, _AFTER, _BAND = "#444444", "#b5541c", "#bcd3e6"
_HEAD = """# Real flags beside published measurements

Nobody has published a film of a weighed flag beside an anemometer, but drag, waves, frequency and droop of real flags
have been measured. Here the base model predicts each number, and so does the same model with one effect, whose only
strength was fitted to two of them. `python -m tests.studies real-flags --out docs/results` makes this page, and
`python -m tests.studies published-flags NAME` one number of the base model (without a name, all of them).

The flag is 1.5 × 1.0 m, held at its two hoist corners, of Camel Ponte Roma made 284 or 110 g/m², with its declared
damping and contact. Drag is the mean force on the attachments over ½ ρ U² L H, ρ = 1.2 kg/m³. Waves are those of the
leading complex orthogonal mode of the middle line. A band is the published range, or the published number with the
tolerance of the aim: 30 % of the codes' drag, 15 % of wavelength and wave speed. After ± stands one standard error, of
starts, meshes and steps. *Held* is a prediction within its band, *not held* one that is outside by more than three
errors, *within the error* any other. The last column is what the effect changes, over the error of the difference: from
three on the effect is known to change the number.
"""


def page(
    base: Predictions,
    after: Predictions,
    fit: Fit,
    controls: Sequence[Fit],
    unfitted: FloatArray,
    paper: Paper,
) -> str:
    """The page in Markdown."""
    return "\n".join(
        [
            _HEAD,
            "![Published bands, the base model and the model with the effect](real-flags.png)\n",
            "## The numbers\n",
            *_numbers(base, after),
            "## The sources\n",
            *_sources(),
            "## The verdict\n",
            *_verdict(base, after, fit, controls, unfitted),
            "## The paper flag\n",
            *_paper(paper),
            "## What numerics change\n",
            *_numerics(base, after),
        ]
    )


def _numbers(base: Predictions, after: Predictions) -> list[str]:
    rows = []
    for one in PUBLISHED:
        pairs = list(
            zip(one.bands.items(), with_errors(one, base), with_errors(one, after), strict=False)
        )
        for (name, band), first, second in pairs:
            change, error = second[0] - first[0], math.hypot(first[1], second[1])
            rows.append(
                [
                    one.name,
                    f"{one.quantity}, {name}",
                    one.role,
                    _band(band),
                    _shown(*first),
                    judged(*first, band),
                    _shown(*second),
                    judged(*second, band),
                    f"{change / error:+.1f}" if error else "0",
                ]
            )
        if not pairs:
            bands = "; ".join(_band(band) for band in one.bands.values() if math.isfinite(band[1]))
            rows.append(
                [
                    one.name,
                    one.quantity,
                    one.role,
                    bands,
                    "",
                    "not comparable",
                    "",
                    "not comparable",
                    "",
                ]
            )
    head = [
        "name",
        "quantity",
        "used to",
        "published",
        "base",
        "",
        f"with {NAMED}",
        "",
        "change/error",
    ]
    return [table(head, rows), ""]


def _sources() -> list[str]:
    rows = [[one.name, one.condition, one.source, one.sure] for one in PUBLISHED]
    opened = (
        "None of the sources could be opened in full: the codes and the books are not free, and of "
        "the articles the "
        "abstracts were read. Scatter and conditions of the measurements are missing; a band says "
        "no more than its "
        "row.\n"
    )
    return [table(["name", "condition", "source", "how sure"], rows), "", opened]


def _verdict(
    base: Predictions, after: Predictions, fit: Fit, controls: Sequence[Fit], unfitted: FloatArray
) -> list[str]:
    low, high = fit.interval
    parameter = CANDIDATES[NAMED][0]
    counts = {name: _held(model) for name, model in (("base", base), ("after", after))}
    found = (
        f"Fitted to the drag of AS 1170.2 and the wavelength, **{NAMED}** has the {parameter} "
        f"{fit.strength:.2f} "
        f"[{low:.2f}, {high:.2f}]. The interval is that of fits that leave one flag of one number "
        "out. Of "
        f"the predictions that judge, {counts['after'][0]} of {counts['after'][1]} are held with "
        "it and "
        f"{counts['base'][0]} of {counts['base'][1]} without. "
        "[Decision 052](../decisions/052-the-inertia-of-the-air-beside-a-flag.md) "
        "says what follows.\n"
    )
    about = (
        "Controls have the same freedom, one strength, and are fitted to the same numbers. The "
        "misfit is the root mean "
        "square of what predictions are off the middle of their bands by, in halves of the width: "
        "1 is the edge. It is "
        "of the four flags at 6 and 10 m/s, two starts each, linear between the strengths "
        "simulated.\n"
    )
    rows = [["none", "", "", *scores(unfitted)]] + [
        [
            one.name,
            f"{one.strength:.3g}",
            f"{one.interval[0]:.3g} to {one.interval[1]:.3g}",
            *scores(one.readings),
        ]
        for one in (fit, *controls)
    ]
    by_number = [
        [
            one.name,
            one.role,
            *(f"{np.sqrt(np.mean(misfit(one, model.mean) ** 2)):.2f}" for model in (base, after)),
        ]
        for one in PUBLISHED
        if one.predicted is not None
    ]
    return [
        found,
        about,
        table(["effect", "strength", "refits", "misfit, fitted", "misfit, judged"], rows),
        "",
        "Number by number, of all that a number is predicted for:\n",
        table(["name", "used to", "misfit, base", f"misfit, with {NAMED}"], by_number),
        "",
    ]


def _held(model: Predictions) -> tuple[int, int]:
    """How many predictions of the role "judge" are within their bands, and of how many."""
    found = [
        judged(*prediction, band) == "held"
        for one in PUBLISHED
        if one.role is Role.JUDGE
        for prediction, band in zip(with_errors(one, model), one.bands.values(), strict=True)
    ]
    return sum(found), len(found)


def _paper(paper: Paper) -> list[str]:
    models = (paper.base, paper.found, paper.free)
    clips = measured()
    rows = [
        [
            name,
            group,
            f"{speed:g}",
            f"{hz:.1f}",
            *(f"{model.errors[name][0]:+.1%}" for model in models),
        ]
        for name, (speed, hz, group) in clips.items()
    ]
    counts = [
        " and ".join(
            f"{found} of {of} {group.value}"
            for group in Group
            for found, of in [model.within(group, 0.07)]
        )
        for model in models
    ]
    about = (
        "The paper flag of the tunnel (`python -m tests.studies paper-flag`), as a sheet of 138.5 "
        "× 97 mm clamped "
        "along its hoist; the height is 0.7 of the length, by a figure of the authors. The speed "
        "at the sheet is a "
        "factor s of the tunnel's, a nuisance between 0.4 and 0.7. Frequencies, predicted over "
        "measured less 1, of the "
        "base "
        f"model at s = 0.5; with the share of real flags, {paper.found.share:.2f}, and s = "
        f"{paper.found.factor:.2f} "
        f'fitted to the group "fit"; and with both fitted to it, {paper.free.share:.2f} and '
        f"{paper.free.factor:.2f}.\n"
    )
    largest = "; ".join(f"{name}: {change:.1%}" for name, change in paper.numerics.items())
    within = (
        f"Within 7 %: {counts[0]} without the effect; {counts[1]} with the share of real flags; "
        f"{counts[2]} with both "
        f"fitted. Largest change of the last at the clips held out by numerics: {largest}.\n"
    )
    head = [
        "clip",
        "group",
        "tunnel [m/s]",
        "measured [Hz]",
        "base",
        "share of real flags",
        "share and s fitted",
    ]
    lengths = [
        [f"{1e3 * length:.0f}", f"{seen:.1f}"]
        + (
            [f"{found:.1f}", f"{found / seen - 1:+.0%}"]
            if math.isfinite(found)
            else ["none found", ""]
        )
        for length, (seen, found) in paper.stops.items()
    ]
    other = (
        "Where sheets of other lengths stop to flutter, by the last model, which was fitted to no "
        "length: the least "
        "speed simulated that flutters, to 5 %.\n"
    )
    stops = (
        [other, table(["length [mm]", "measured [m/s]", "predicted [m/s]", ""], lengths), ""]
        if lengths
        else []
    )
    return [about, table(head, rows), "", within, *stops]


def _numerics(base: Predictions, after: Predictions) -> list[str]:
    rows = []
    for index, flag in enumerate(PROBED):
        for variant in VARIANTS:
            for name, model in (("base", base), (NAMED, after)):
                values = model.changes[variant][index]
                rows.append([label(flag), variant, name, *(f"{value:.3g}" for value in values)])
    about = (
        "Means of four starts of nine seconds. Of each model the largest change, less what starts "
        "alone would change, "
        "counts in the errors above.\n"
    )
    return [about, table(["flag", "numerics", "model", *READINGS], rows), ""]


def _band(band: tuple[float, float]) -> str:
    return f"{band[0]:.3g} to {band[1]:.3g}"


def _shown(value: float, error: float) -> str:
    return f"{value:.3g} ± {error:.2g}" if math.isfinite(value) else "no wave"


def picture(base: Predictions, after: Predictions, target: Path) -> None:
    """A panel for each published number that something here is comparable with."""
    comparable: list[Published] = [one for one in PUBLISHED if one.predicted is not None]
    figure = Figure(figsize=(11, 2.5 * math.ceil(len(comparable) / 3)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(math.ceil(len(comparable) / 3), 3)).ravel()
    for axes, one in zip(panels, comparable, strict=False):
        for at, (low, high) in enumerate(one.bands.values()):
            axes.bar(at, high - low, bottom=low, width=0.7, color=_BAND)
        for model, colour, shift, name in (
            (base, _BASE, -0.15, "base"),
            (after, _AFTER, 0.15, NAMED),
        ):
            values, errors = np.array(with_errors(one, model)).T
            places = np.arange(len(values)) + shift
            axes.errorbar(
                places, values, yerr=errors, fmt="o", color=colour, ms=4, capsize=2, label=name
            )
        axes.set_xticks(
            range(len(one.bands)), [name.replace(", ", "\n") for name in one.bands], fontsize=7
        )
        axes.set_title(f"{one.name}: {one.quantity}", fontsize=9)
    panels[0].legend(frameon=False, fontsize=7)
    for axes in panels[len(comparable) :]:
        axes.set_axis_off()
    figure.savefig(target, dpi=100)


def scores(values: FloatArray) -> list[str]:
    """Root mean square misfits of what fits and of what judges, of readings of the flags that
    stream."""
    return [
        f"{np.sqrt(np.nanmean(misfits(values, role) ** 2)):.2f}" for role in (Role.FIT, Role.JUDGE)
    ]
