"""What an ingest reports of a camera or a log, as JSON values: stored with the artifact and printed
by `--json`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
from flagdata.core.schema import CHANNELS, Kind
from flagdata.ingest.anemometer.log_reading import streams
from flagdata.record.signals import CameraInfo, WindLog
from flagdata.timebase import NANOSECONDS, iso

REPORT_SCHEMA = "flagdata.ingest-report/1"


@dataclass
class FrameTimes:
    """What is kept of a stream of frames."""

    count: int = 0
    first: int = 0
    last: int = 0
    worst_error: float = 0.0

    def add(self, time: int, stamp_error: float) -> None:
        if not self.count:
            self.first = time
        self.last = time
        self.count += 1
        self.worst_error = max(self.worst_error, stamp_error)

    @property
    def rate(self) -> float | None:
        """Mean frame rate [Hz]; `None` for a single frame."""
        return (self.count - 1) * NANOSECONDS / (self.last - self.first) if self.count > 1 else None


def _span(start: int, end: int) -> dict[str, Any]:
    return {"start": iso(start), "end": iso(end), "span": (end - start) / NANOSECONDS}


def camera_report(
    info: CameraInfo, times: FrameTimes, findings: Sequence[Finding], reasons: Sequence[str]
) -> dict[str, Any]:
    """Reports a camera; times in UTC, durations in seconds, rates in Hz."""
    return {
        "schema": REPORT_SCHEMA,
        "kind": Kind.CAMERA.value,
        "format": f"{info.container} / {info.codec}",
        "reasons": list(reasons),
        **_span(times.first, times.last),
        "frames": times.count,
        "rate": times.rate,
        "worst_stamp_error": times.worst_error,
        "camera": {**vars(info), "crop": list(info.crop), "start": iso(info.start)},
        "findings": json_values(findings),
    }


def wind_report(
    log: WindLog, findings: Sequence[Finding], *, recipe_file: str | None
) -> dict[str, Any]:
    """Reports a log; of a recipe file that was named, only its base name stays."""
    series = log.series
    time = series.time
    kinds = [time[rows] for _, rows in streams(series.channels)]
    steps = np.diff(max(kinds, key=len))
    longest = max((int(np.diff(kind).max()) for kind in kinds if len(kind) > 1), default=None)
    speed = series.channels.get("wind_speed")
    sensor = {name: value for name, value in vars(series.sensor).items() if value is not None}
    return {
        "schema": REPORT_SCHEMA,
        "kind": Kind.WIND.value,
        "format": log.format,
        "reasons": [
            r.replace(recipe_file, Path(recipe_file).name) if recipe_file else r
            for r in log.reasons
        ],
        **_span(int(time[0]), int(time[-1])),
        "samples": len(series),
        "rate": float(NANOSECONDS / np.median(steps)) if len(steps) else None,
        "longest_gap": longest / NANOSECONDS if longest is not None else None,
        "channels": {
            name: {"unit": CHANNELS[name].unit, "values": int(np.isfinite(values).sum())}
            for name, values in series.channels.items()
        },
        "mean_speed": float(np.nanmean(speed))
        if speed is not None and np.isfinite(speed).any()
        else None,
        "sensor": sensor,
        "findings": json_values(findings),
    }
