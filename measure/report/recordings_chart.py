"""What was recorded: each marker over time, with its gaps, and the wind below."""

from __future__ import annotations

import numpy as np

from flagdata.answer.charts import Axis, Cells, Chart, Colour, Line, Panel
from measure.trajectories.trajectory import Trajectory

_COLUMNS = 600
"""Instants that are drawn at most."""


def recording_chart(recording: Trajectory) -> Chart:
    """Draws the distance of each marker from its mean place, in rows from the hoist to the fly,
    blank where it was not tracked, and the logged wind."""
    stride = -(-len(recording.positions) // _COLUMNS)
    times = recording.times[::stride]
    positions = recording.positions[::stride]
    seen = np.asarray(np.isfinite(positions).all(axis=2))
    if recording.seen is not None:
        seen &= recording.seen[::stride]
    shown = np.where(seen[..., None], positions, np.nan)
    count = np.maximum(seen.sum(axis=0), 1)[:, None]
    away = np.linalg.norm(shown - np.nansum(shown, axis=0) / count, axis=2)
    order = np.lexsort((recording.markers[:, 1], recording.markers[:, 0]))
    span = (float(times[0]), float(times[-1]))
    wind = np.linalg.norm(recording.wind.at(times), axis=-1)
    markers = Cells(values=away[:, order].T, x=span, y=(0.5, len(order) + 0.5))
    rows = [
        Panel(
            marks=[markers],
            title="distance of each marker from its mean place; blank: not tracked",
            x=Axis(limits=span),
            y=Axis(label="marker, hoist to fly"),
        ),
        Panel(
            marks=[Line(x=times, y=wind, colour=Colour.LOG)],
            x=Axis(label="time [s]", limits=span),
            y=Axis(label="wind [m/s]", limits=(0, None)),
        ),
    ]
    return Chart(rows=[[panel] for panel in rows], heights=[2.6, 1.5])
