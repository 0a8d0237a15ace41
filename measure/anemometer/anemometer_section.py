"""What a calibration as an anemometer found, as a section of a page, and as a page of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from flagdata.core.provenance import code_version
from flagdata.pages.page_pictures import figure_url
from flagdata.pages.render import render
from measure.anemometer.reading_calibration import CLOCK, Calibrated
from measure.estimate.measurement_page import Section

_BLUE, _RUST = "#2b6f8f", "#c4622d"


def section(result: Calibrated) -> Section:
    """Renders the section, with the windows beside the log."""
    values = {
        "sentence": result.sentence,
        "series": _picture(result),
        "level": f"{result.level * 100:.3g} %",
        "clock": _clock(result),
        "recordings": [
            {
                "name": recording.name,
                "windows": int(recording.usable.sum()),
                "anemometer": recording.sensor.name,
                "accuracy": _with_unit(recording.sensor.accuracy, "m/s"),
                "distance": _with_unit(recording.sensor.distance_constant, "m"),
            }
            for recording in result.recordings
        ],
        "findings": [
            {"severity": f.severity.value, "what": f.what, "fix": f.fix} for f in result.findings
        ],
    }
    body = Markup(render("measure.anemometer", "section.html.j2", values))
    return Section(anchor="anemometer", title="The flag as an anemometer", body=body)


def page(result: Calibrated, name: str, provenance: Mapping[str, str]) -> str:
    """Renders the page of a reading model alone.

    Args:
        name: of the model.
        provenance: rows of a table, in order.
    """
    values = {
        "name": name,
        "section": section(result),
        "provenance": {**provenance, "code": code_version()},
    }
    return render("measure.anemometer", "page.html.j2", values)


def _with_unit(value: float | None, unit: str) -> str:
    return "not stated" if value is None else f"{value:g} {unit}"


def _clock(result: Calibrated) -> str:
    if not result.clock:
        return "The recording states no uncertainty of its clock; none was fitted."
    if result.clock <= CLOCK:
        return (
            f"The clock is known to {result.clock:.2f} s, which matters for no window; no error of "
            "it was fitted."
        )
    return (
        f"The log fits best {result.offset:+.2f} s later than its stamps, whose standard "
        "uncertainty is "
        f"{result.clock:.2f} s."
    )


def _picture(result: Calibrated) -> str:
    from matplotlib.figure import Figure

    model = result.model
    read = model.winds - model.errors
    uncalibrated = np.concatenate(
        [recording.features.winds[recording.usable] for recording in result.recordings]
    )
    figure = Figure(figsize=(9.5, 3.2), layout="constrained")
    course, scatter = figure.subplots(1, 2, width_ratios=(2.4, 1.0))
    time = model.step * np.arange(len(read))
    course.fill_between(
        time, read - result.half_width, read + result.half_width, color=_BLUE, alpha=0.25, lw=0
    )
    course.plot(time, read, color=_BLUE, lw=1)
    course.plot(time, model.winds, color="black", lw=1)
    course.set_xlabel("time over all windows [s]")
    course.set_ylabel("wind [m/s]")
    scatter.plot(model.winds, uncalibrated, ".", ms=3, color=_RUST)
    scatter.plot(model.winds, read, ".", ms=3, color=_BLUE)
    ends = [float(model.winds.min()), float(model.winds.max())]
    scatter.plot(ends, ends, color="black", lw=0.8)
    scatter.set_xlabel("log [m/s]")
    scatter.set_ylabel("read [m/s]")
    return figure_url(figure)
