"""What a flag that was made an anemometer answers: how well it reads the wind, and of what."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from flagdata.answer import Array, Figure, Head, Section, Table
from flagdata.answer.calibrated import Calibrated
from flagdata.answer.charts import Axis, Band, Chart, Colour, Dots, Line, Panel
from flagdata.answer.circumstances import list_circumstances
from flagdata.core.findings import Severity
from flagdata.core.shell import command_line
from flagdata.pages.page_pictures import moving
from measure.anemometer.making import Made
from measure.anemometer.reading_calibration import CLOCK, ReadingCalibration

_SIDE = 300
"""Of the film on the page [px]."""
_WIDTH = 560
"""Of the chart beside it [px]."""


def answer_of_reading(made: Made) -> Calibrated:
    """Returns the answer."""
    result = made.result
    model = result.model
    provenance = {one.name: f"recording {one.artifact}" for one in result.recordings}
    provenance["network"] = f"{model.network}, SHA-256 {model.identity}"
    if made.artifact is not None:
        provenance["artifact"] = made.artifact
    option = command_line("--model", made.name)
    return Calibrated(
        question="calibrate",
        subject=made.name,
        sentence=_sentence(result),
        findings=result.findings,
        document={"anemometer": made.document},
        arrays=_arrays(result),
        head=Head(
            figures=[_film(result), _both_winds(result)],
            facts=_facts(result),
            limits=[
                *(one.sentence for one in result.findings if one.severity is not Severity.NOTE),
                "It reads this flag from this place.",
            ],
            remarks=[
                Markup("For other films of it: <code>flagdata measure FILM {}</code>").format(
                    option
                )
            ],
        ),
        make_sections=lambda: [reading_section(result)],
        provenance=provenance,
        level=result.level,
    )


def reading_section(result: ReadingCalibration) -> Section:
    """Makes the section on the flag as an anemometer, with the windows beside the log."""
    return Section(
        title="The flag as an anemometer",
        parts=[
            f"{result.sentence[0].upper()}{result.sentence[1:]}.",
            _windows_figure(result),
            _clock(result),
            Table(
                columns=(
                    "recording",
                    "windows",
                    "anemometer",
                    "states an accuracy of",
                    "distance constant",
                ),
                rows=[
                    (
                        one.name,
                        str(one.windows),
                        one.sensor.name,
                        _with_unit(one.sensor.accuracy, "m/s"),
                        _with_unit(one.sensor.distance_constant, "m"),
                    )
                    for one in result.recordings
                ],
            ),
        ],
        anchor="anemometer",
        folded=True,
    )


def _arrays(result: ReadingCalibration) -> dict[str, Array]:
    """Returns winds (window,) in the order of time."""
    model, half = result.model, result.half_width
    read = model.winds - model.errors
    names = np.repeat(
        np.array([one.name for one in result.recordings]),
        [one.windows for one in result.recordings],
    )
    starts = np.concatenate([one.features.starts[one.usable] for one in result.recordings])
    network = np.concatenate([one.features.winds[one.usable] for one in result.recordings])
    winds = {
        "wind_speed": (read, "read of the window by a fit to all other blocks of time"),
        "wind_speed_low": (np.maximum(read - half, 0.0), "lower end of its interval"),
        "wind_speed_high": (read + half, "upper end of its interval"),
        "wind_logged": (model.winds, "mean of the log over the window"),
        "wind_of_network": (network, "read by the network alone"),
    }
    window = ("window",)
    return {
        "recording": Array(dimensions=window, values=names, coordinate=True),
        "start": Array(
            dimensions=window,
            values=starts,
            unit="s",
            about="of the window, from the film's first frame",
            coordinate=True,
        ),
        **{
            name: Array(dimensions=window, values=values, unit="m/s", about=about)
            for name, (values, about) in winds.items()
        },
    }


def _sentence(result: ReadingCalibration) -> str:
    low, high = result.model.range
    winds = f"This flag reads winds of {low:.1f} to {high:.1f} m/s"
    if math.isinf(result.half_width):
        return f"{winds}, with a standard error of {result.model.rmse:.2f} m/s."
    return f"{winds}, {_percent(result)} of the time to within {result.half_width:.2f} m/s."


def _percent(result: ReadingCalibration) -> str:
    return f"{result.level * 100:.3g} %"


def _facts(result: ReadingCalibration) -> dict[str, str]:
    size, model = result.model.size, result.model
    return {
        "recordings": ", ".join(one.name for one in result.recordings),
        **list_circumstances([one.circumstances for one in result.recordings]),
        "windows": f"{result.windows} of {model.step:.2g} s",
        "flag": f"{size.length:g} m × {size.height:g} m",
        **({"clock": _clock(result)} if result.clock_sigma else {}),
    }


def _film(result: ReadingCalibration) -> Figure:
    first = result.recordings[0]
    features = first.features
    rate = (len(features.clip) - 1) / features.layout.length
    url = moving(features.clip, rate=rate, side=_SIDE)
    title = f"{first.name}, a window of the film"
    return Figure(title=title, content=url, caption=title, width=_SIDE)


def _both_winds(result: ReadingCalibration) -> Figure:
    return Figure(
        title="The wind that is read, beside the log's",
        content=lambda: Chart(rows=[[_course(result)]], width=4.8, height=2.9),
        width=_WIDTH,
    )


def _windows_figure(result: ReadingCalibration) -> Figure:
    return Figure(
        title="The log's wind and the wind that is read, window by window",
        content=lambda: Chart(rows=[[_course(result), _scatter(result)]], widths=(2.4, 1.0)),
        caption="The log is the mean over each window, its instrument's lag undone where that is "
        "stated. Each window is read by a fit to all other blocks of time.",
    )


def _course(result: ReadingCalibration) -> Panel:
    model = result.model
    read = model.winds - model.errors
    time = np.asarray(model.step * np.arange(len(read)), np.float64)
    half = result.half_width
    return Panel(
        marks=[
            Band(x=time, low=read - half, high=read + half, opacity=0.25),
            Line(x=time, y=read, width=1.0, label=f"read off the flag, with {_percent(result)}"),
            Line(x=time, y=model.winds, colour=Colour.LOG, width=1.0, label="logged"),
        ],
        x=Axis(label="time over all windows [s]"),
        y=Axis(label="wind [m/s]"),
    )


def _scatter(result: ReadingCalibration) -> Panel:
    model = result.model
    network = np.concatenate([one.features.winds[one.usable] for one in result.recordings])
    ends = [float(model.winds.min()), float(model.winds.max())]
    return Panel(
        marks=[
            Dots(x=model.winds, y=network, colour=Colour.THIRD, size=2.0, label="network alone"),
            Dots(x=model.winds, y=model.winds - model.errors, size=2.0),
            Line(x=ends, y=ends, colour=Colour.QUIET, width=0.8),
        ],
        x=Axis(label="logged [m/s]"),
        y=Axis(label="read [m/s]"),
    )


def _with_unit(value: float | None, unit: str) -> str:
    return "not stated" if value is None else f"{value:g} {unit}"


def _clock(result: ReadingCalibration) -> str:
    if not result.clock_sigma:
        return "The recording states no uncertainty of its clock; none was fitted."
    if result.clock_sigma <= CLOCK:
        return (
            f"The clock is known to {result.clock_sigma:.2f} s, which matters for no window; no "
            "error of it was fitted."
        )
    return (
        f"The log fits best {result.clock_offset:+.2f} s later than its stamps, whose standard "
        f"uncertainty is {result.clock_sigma:.2f} s."
    )
