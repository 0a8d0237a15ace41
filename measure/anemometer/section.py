"""What a calibration as an anemometer found, as a section of a page, and as a page of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from flagdata.pages.pictures import figure_url
from flagdata.pages.render import render
from flagdata.provenance import code_version
from measure.anemometer.calibration import Calibrated
from measure.estimate.page import Section

_BLUE, _RUST = "#2b6f8f", "#c4622d"


def section(found: Calibrated) -> Section:
    """The section, with the windows beside the log."""
    values = {
        "sentence": found.sentence,
        "series": _picture(found),
        "level": f"{found.level * 100:.3g} %",
        "clock": _clock(found),
        "recordings": [
            {
                "name": one.name,
                "windows": int(one.usable.sum()),
                "anemometer": one.sensor.name,
                "accuracy": _stated(one.sensor.accuracy, "m/s"),
                "distance": _stated(one.sensor.distance_constant, "m"),
            }
            for one in found.recordings
        ],
        "findings": [{"severity": f.severity.value, "what": f.what, "fix": f.fix} for f in found.findings],
    }
    body = Markup(render("measure.anemometer", "section.html.j2", values))
    return Section(anchor="anemometer", title="The flag as an anemometer", body=body)


def page(found: Calibrated, name: str, provenance: Mapping[str, str]) -> str:
    """The page of a reading model alone.

    Args:
        name: of the model.
        provenance: rows of a table, in order.
    """
    values = {"name": name, "section": section(found), "provenance": {**provenance, "code": code_version()}}
    return render("measure.anemometer", "page.html.j2", values)


def _stated(value: float | None, unit: str) -> str:
    return "not stated" if value is None else f"{value:g} {unit}"


def _clock(found: Calibrated) -> str:
    if not found.clock:
        return "The recording states no uncertainty of its clock; none was fitted."
    return (
        f"The log fits best {found.offset:+.2f} s later than its stamps, whose standard uncertainty is "
        f"{found.clock:.2f} s."
    )


def _picture(found: Calibrated) -> str:
    from matplotlib.figure import Figure

    model = found.model
    read = model.winds - model.errors
    alone = np.concatenate([one.features.winds[one.usable] for one in found.recordings])
    figure = Figure(figsize=(9.5, 3.2), layout="constrained")
    course, beside = figure.subplots(1, 2, width_ratios=(2.4, 1.0))
    time = model.step * np.arange(len(read))
    course.fill_between(time, read - found.half_width, read + found.half_width, color=_BLUE, alpha=0.25, lw=0)
    course.plot(time, read, color=_BLUE, lw=1)
    course.plot(time, model.winds, color="black", lw=1)
    course.set_xlabel("time over all windows [s]")
    course.set_ylabel("wind [m/s]")
    beside.plot(model.winds, alone, ".", ms=3, color=_RUST)
    beside.plot(model.winds, read, ".", ms=3, color=_BLUE)
    ends = [float(model.winds.min()), float(model.winds.max())]
    beside.plot(ends, ends, color="black", lw=0.8)
    beside.set_xlabel("log [m/s]")
    beside.set_ylabel("read [m/s]")
    return figure_url(figure)
