"""What a calibration answers: what the cloth weighs, what that rests on, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from flagdata.answer import Array, Figure, Head, Section, Table, Tone
from flagdata.answer.calibrated import Calibrated
from flagdata.answer.charts import Chart, Colour
from flagdata.answer.circumstances import list_circumstances
from flagdata.answer.quantity import Quantity
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Severity
from flagdata.core.shell import command_line
from flagdata.pages.page_pictures import moving
from measure.cloth.calibration_result import Calibration, Fitted
from measure.cloth.flag_prior import CLOTH
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.observables_chart import Predicted, chart_against_wind
from measure.cloth.posterior_chart import posterior_panel
from measure.observables import OBSERVABLES

_SIDE = 300
"""Of the film on the page [px]."""
_WIDTH = 460
"""Of the chart beside it [px]."""
_RATE = 12.5
"""Of the film on the page [Hz]: half of the frames of a usual one."""
_LIMITS = 3
"""So many of the warnings are on the first screen; all of them are below."""


def answer_of_calibration(
    calibration: Calibration,
    *,
    artifact: str | None = None,
    others: Sequence[Section] = (),
    further: Mapping[str, Any] | None = None,
) -> Calibrated:
    """Returns the answer.

    Args:
        artifact: its id in the lake; None where it is not to be there.
        others: sections of what was made of the same recordings.
        further: JSON values of what was made of them.
    """

    def make_sections() -> list[Section]:
        recordings = [_recording_section(one, calibration) for one in calibration.recordings]
        return [_cloth_section(calibration), *recordings, _check_section(calibration), *others]

    return Calibrated(
        question="calibrate",
        subject=", ".join(one.observed.name for one in calibration.recordings),
        sentence=_sentence(calibration),
        tone=_tone(calibration),
        quantities=calibration.cloth,
        findings=calibration.findings,
        document={**calibration.document, **(further or {})},
        arrays=_arrays(calibration),
        head=Head(
            figures=_head_figures(calibration),
            facts=_facts(calibration),
            limits=_limits(calibration),
            remarks=_remarks(calibration),
        ),
        make_sections=make_sections,
        provenance=_provenance(calibration, artifact),
        level=calibration.level,
        draws={name: calibration.draws.cloth[name] for name in calibration.cloth},
        withheld=calibration.withheld,
        stated=calibration.area_weight_stated,
    )


def _arrays(calibration: Calibration) -> dict[str, Array]:
    """Returns draws (draw,), and readings and what simulated flags of the cloth show of them
    (recording, window, observable), NaN beyond a recording's end."""
    arrays = (
        {} if calibration.withheld else arrays_of_draws(calibration.cloth, calibration.draws.cloth)
    )
    recordings = calibration.recordings
    most = max(one.windows for one in recordings)

    def stacked(several: Sequence[FloatArray]) -> FloatArray:
        rows = [
            np.pad(one, [(0, most - len(one)), *[(0, 0)] * (one.ndim - 1)], constant_values=np.nan)
            for one in several
        ]
        return np.stack(rows)

    windows = ("recording", "window")
    observables = (*windows, "observable")
    units = np.array([OBSERVABLES[name].unit for name in OBSERVED])
    names = np.array([one.observed.name for one in recordings])
    in_units = "in the unit of its observable"
    parts = {
        "reading": ([one.observed.readings for one in recordings], "of each window"),
        "expected_low": ([one.low for one in recordings], "lower end of simulated flags"),
        "expected": ([one.middle for one in recordings], "median of simulated flags"),
        "expected_high": ([one.high for one in recordings], "upper end of simulated flags"),
    }
    return {
        **arrays,
        "recording": Array(dimensions=("recording",), values=names, coordinate=True),
        "observable": Array(dimensions=("observable",), values=np.array(OBSERVED), coordinate=True),
        "observable_unit": Array(dimensions=("observable",), values=units, coordinate=True),
        "wind_speed": Array(
            dimensions=windows,
            values=stacked([one.observed.speed for one in recordings]),
            unit="m/s",
            about="mean of the log over the window",
        ),
        **{
            name: Array(
                dimensions=observables, values=stacked(several), about=f"{about}, {in_units}"
            )
            for name, (several, about) in parts.items()
        },
    }


def arrays_of_draws(
    quantities: Mapping[str, Quantity], draws: Mapping[str, FloatArray]
) -> dict[str, Array]:
    """Returns draws (draw,) of a joint posterior."""
    return {
        f"{name}_draws": Array(
            dimensions=("draw",),
            values=draws[name],
            unit=one.unit,
            about=f"draws of the posterior of the {name.replace('_', ' ')}",
        )
        for name, one in quantities.items()
    }


def _sentence(calibration: Calibration) -> str:
    weight = calibration.weight
    if calibration.withheld is not None:
        return "No weight is given, because no simulated flag moves like the one that was filmed."
    if not weight.constrained:
        return "The recordings do not show what the cloth weighs."
    return f"The cloth weighs {phrase_quantity(weight)}."


def phrase_quantity(quantity: Quantity) -> str:
    """Phrases a quantity that is constrained, as people say it."""
    certain = f"with {quantity.span.percent} probability"
    if quantity.value is None:
        return f"{quantity.span.word(quantity.write, quantity.suffix)}, {certain}"
    low, high = map(quantity.write, quantity.interval)
    value = f"{quantity.write(quantity.value)}{quantity.suffix}"
    return f"{value}, {certain} between {low} and {high}"


def _tone(calibration: Calibration) -> Tone:
    if not calibration.weighs:
        return Tone.MISSED
    return Tone.OPEN if calibration.weight.value is None else Tone.SETTLED


def _remarks(calibration: Calibration) -> list[str | Markup]:
    if calibration.withheld is not None:
        return [f"What is unlike: {calibration.withheld}."]
    stated = calibration.area_weight_stated
    if stated is None:
        return []
    option = command_line("--area-weight", stated)
    return [Markup("For <code>flagdata measure</code>: <code>{}</code>").format(option)]


def _facts(calibration: Calibration) -> dict[str, str]:
    options = calibration.options
    winds = np.concatenate([one.observed.speed for one in calibration.recordings])
    lags = {one.observed.log.distance for one in calibration.recordings}
    facts = {
        "recordings": ", ".join(
            f"{one.observed.name} ({one.observed.duration:.0f} s)" for one in calibration.recordings
        ),
        **list_circumstances([one.observed.circumstances for one in calibration.recordings]),
        "wind": f"{winds.min():.1f} to {winds.max():.1f} m/s, logged",
        "flag": options.flag.words,
        "camera": f"{options.azimuth.degrees} from the wind's direction, {options.distance:g} m "
        "away",
    }
    known = [lag for lag in lags if lag is not None]
    if known and max(known) > 0:
        facts["lag of the anemometer"] = f"{max(known):g} m of wind, undone"
    return facts


def _limits(calibration: Calibration) -> list[str]:
    warnings = [one.sentence for one in calibration.findings if one.severity is not Severity.NOTE]
    return warnings[:_LIMITS]


def _head_figures(calibration: Calibration) -> list[Figure]:
    figures = []
    filmed = [one.observed for one in calibration.recordings if one.observed.excerpt is not None]
    if filmed and (excerpt := filmed[0].excerpt) is not None:
        window = excerpt.window
        seconds = float(window.times[-1] - window.times[0])
        step = max(1, round((len(window.times) - 1) / max(seconds * _RATE, 1e-9)))
        clip = window.frames[::step]
        url = moving(clip, rate=(len(clip) - 1) / max(seconds, 1e-9), side=_SIDE)
        title = f"{filmed[0].name}, a window of the film"
        figures.append(Figure(title=title, content=url, caption=title, width=_SIDE))
    else:
        figures.append(_droop_figure(calibration))
    if calibration.withheld is None:
        about = CLOTH[0]
        draws = calibration.draws.cloth[about.name]

        def chart() -> Chart:
            panel = posterior_panel(about, calibration.weight, draws)
            return Chart(rows=[[panel]], width=4.8, height=2.9)

        title = "What the cloth can weigh, before and after the recordings"
        figures.append(Figure(title=title, content=chart, width=_WIDTH))
    return figures


def _droop_figure(calibration: Calibration) -> Figure:
    """Shows what a table says most of the weight: the first observable that the answer rests on."""
    first = calibration.recordings[0]
    return Figure(
        title=f"{first.observed.name}: what the flag did in the wind",
        content=lambda: _windows_chart(first, calibration, first.observables[:1]),
        width=_WIDTH,
    )


def _windows_chart(recording: Fitted, calibration: Calibration, names: Sequence[str]) -> Chart:
    model = Predicted(
        limits=np.stack([recording.low, recording.middle, recording.high]),
        colour=Colour.LOG,
        label=f"simulated flags of this cloth, {calibration.level * 100:.3g} %",
    )
    return chart_against_wind(recording.observed, names, [model], dots=Colour.FILM)


def _cloth_section(calibration: Calibration) -> Section:
    parts: list[Table | Figure] = [table_of_quantities("quantity", calibration.cloth)]
    if calibration.withheld is None:

        def chart() -> Chart:
            panels = [
                posterior_panel(about, quantity, calibration.draws.cloth[about.name])
                for about, quantity in zip(CLOTH, calibration.cloth.values(), strict=True)
            ]
            return Chart(rows=[panels], height=2.8)

        parts.append(
            Figure(
                title="Area weight, bending and damping before and after the recordings",
                content=chart,
                caption="The prior gives each bar the same share.",
            )
        )
    return Section(title="The cloth", parts=parts, anchor="cloth", folded=True)


def table_of_quantities(heading: str, quantities: Mapping[str, Quantity]) -> Table:
    """Makes a table of quantities with what was assumed of each before."""
    return Table(
        columns=(heading, "value", "assumed before"),
        rows=[
            (
                name.replace("_", " "),
                one.text_with_level if one.constrained else "not determined",
                one.assumed_text,
            )
            for name, one in quantities.items()
        ],
    )


def _recording_section(recording: Fitted, calibration: Calibration) -> Section:
    share = f"{100 * recording.misfit:.2g} %"
    return Section(
        title=f"{recording.observed.name}: {recording.windows} windows against the wind",
        parts=[
            (
                f"Of simulated flags of this cloth {share} look as unusual as this one, or more "
                "so. The "
                f"wind was {recording.wind_speed:.1f} m/s in the mean."
            ),
            Figure(
                title=f"Observables of {recording.observed.name} against the wind",
                content=lambda: _windows_chart(recording, calibration, recording.observables),
                caption="The band is that of means, without the scatter among windows.",
            ),
            table_of_quantities("place and anemometer", recording.place),
        ],
        folded=True,
    )


def _check_section(calibration: Calibration) -> Section:
    check = calibration.check
    return Section(
        title="How far the interval is to be relied on",
        parts=[
            (
                f"The same procedure weighed {check.count} simulated flags that it was not fitted "
                "to. "
                f"{check.held} of them have their weight in the interval at "
                f"{calibration.level * 100:.3g} %; the median error is {check.median_error:.1%}."
            )
        ],
        anchor="check",
        folded=True,
    )


def _provenance(calibration: Calibration, artifact: str | None) -> dict[str, str]:
    options = calibration.options
    rows = {
        f"recording {number}": f"{one.observed.name}, from {one.observed.first:g} s on, "
        f"{one.observed.source}"
        for number, one in enumerate(calibration.recordings, start=1)
    }
    rows |= {name.replace("_", " "): str(value) for name, value in options.recipe().items()}
    rows |= {about.name: about.degrees for about in (options.azimuth, options.elevation)}
    return rows if artifact is None else {**rows, "artifact": artifact}
