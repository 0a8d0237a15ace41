"""Series beside a film: what `flagdata.wind` and `flagdata.motion` return."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.html import table
from flagdata.record.signals import Sensor
from flagdata.timebase import iso


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Wind:
    """Samples of an anemometer.

    Attributes:
        name: of the log.
        time: (n,) since the first sample, ascending [s].
        start: instant of the first sample, on the log's own clock, or of a recording on the common
            one [UTC ns].
        speed: (n,) of the air over ground [m/s]; NaN where it is missing, or flagged as what
            averages leave out.
        direction: (n,) blowing from, clockwise from north [rad]; NaN where `speed` is, or where it
            was not logged.
        channels: name → (n,) of everything that was logged, SI, flagged samples too.
        flags: (n,) bits of `flagdata.core.schema.SampleFlag`; averages leave out `UNUSABLE`.
        sensor: the instrument.
        findings: what was noticed in the log.
    """

    name: str
    time: FloatArray
    start: int
    speed: FloatArray
    direction: FloatArray
    channels: Mapping[str, FloatArray]
    flags: NDArray[np.uint16]
    sensor: Sensor
    findings: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return len(self.time)

    def _rows(self) -> dict[str, str]:
        finite = self.speed[np.isfinite(self.speed)]
        course = (
            f"{finite.mean():.2f} m/s, {finite.min():.2f} to {finite.max():.2f} m/s"
            if len(finite)
            else "none"
        )
        last = self.time[-1] if len(self) else 0.0
        return {
            "samples": f"{len(self)} in {last:.1f} s from {iso(self.start)}",
            "speed": course,
            "sensor": self.sensor.name,
            **{
                f"{finding.severity.value} {finding.kind}": finding.what
                for finding in self.findings
            },
        }

    def __repr__(self) -> str:
        rows = self._rows()
        noticed = f", {len(self.findings)} findings" if self.findings else ""
        return f"Wind({self.name}: {rows['samples']}; {rows['speed']}; {self.sensor.name}{noticed})"

    def _repr_html_(self) -> str:
        return table(f"Wind of {self.name}", self._rows())


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Motion:
    """How much a film moves, frame by frame; see `flagdata.align.film_motion`.

    Attributes:
        name: of the film.
        time: (n,) midway between the two frames compared, since the first frame [s].
        start: instant of the first frame [UTC ns]; None where nobody said.
        energy: (n,) mean change of brightness above noise [gray levels/s]; NaN where frames are too
            far apart.
        findings: what was noticed about the picture: camera shake, flicker, no motion.
    """

    name: str
    time: FloatArray
    start: int | None
    energy: FloatArray
    findings: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return len(self.time)

    def _rows(self) -> dict[str, str]:
        finite = self.energy[np.isfinite(self.energy)]
        course = (
            f"{finite.mean():.2f}, {finite.min():.2f} to {finite.max():.2f}"
            if len(finite)
            else "none"
        )
        return {
            "pairs of frames": f"{len(self)}, to {self.time[-1] if len(self) else 0.0:.2f} s",
            "energy [gray levels/s]": course,
            **{
                f"{finding.severity.value} {finding.kind}": finding.what
                for finding in self.findings
            },
        }

    def __repr__(self) -> str:
        energy = self._rows()["energy [gray levels/s]"]
        noticed = f", {len(self.findings)} findings" if self.findings else ""
        return f"Motion({self.name}: {len(self)} pairs of frames; {energy} gray levels/s{noticed})"

    def _repr_html_(self) -> str:
        return table(f"Motion of {self.name}", self._rows())
