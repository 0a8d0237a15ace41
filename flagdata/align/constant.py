"""A wind that somebody states instead of measuring it: a tunnel's constant speed, known to a σ, all
along a film.

It becomes a wind artifact on the film's own clock, so that everything behind it (recordings, clips,
their σ) goes as
with a log: a sample a second of the stated speed, of an instrument whose accuracy is the stated σ.
The quality flag "wind-declared" goes with it into the recording and its clips.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from flagdata.align.declared import by_stamps
from flagdata.align.film_recording import (
    MARGIN_AFTER,
    MARGIN_BEFORE,
    Alignment,
    Pair,
    Progress,
    RecordingResult,
    add_recording,
    make_recording,
    recording_result,
    session_of,
)
from flagdata.align.present import find_made, provenance
from flagdata.core.findings import Finding, Severity, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.schema import Kind
from flagdata.errors import UsageError
from flagdata.lake import Artifact, Lake, Transaction
from flagdata.record import RecordWriter
from flagdata.record.metadata import PROVENANCE
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS, iso

REPORT_SCHEMA = "flagdata.declared-wind-report/1"
DECLARED = "wind-declared"
SAME_CLOCK = 1e-3
"""σ of a film's clock on a declared wind's [s]: they are one clock, and the model asks for a σ
above 0."""


@dataclass(frozen=True, kw_only=True)
class ConstantWind:
    """A wind of `speed` all along, known to the standard uncertainty `sigma` [m/s].

    Raises:
        UsageError: a speed below 0, a σ that is not above 0, or numbers that are not finite.
    """

    speed: float
    sigma: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.speed) and self.speed >= 0):
            raise UsageError(
                f"the wind speed {self.speed} m/s is not a number of 0 or more",
                where="--speed",
                fix="give a speed of 0 or more in m/s",
            )
        if not (math.isfinite(self.sigma) and self.sigma > 0):
            raise UsageError(
                f"the uncertainty {self.sigma} m/s of the wind is not a positive number",
                where="--sigma",
                fix="state how well the speed is known, in m/s (one standard deviation)",
            )

    def recipe(self) -> dict[str, Any]:
        """Returns what the artifact's identity depends on, beside the film."""
        return {"declare": {"wind": self.speed, "sigma": self.sigma}}

    def series(self, start: int, end: int) -> WindSeries:
        """Samples on whole seconds from `start` to `end` and beyond [UTC ns]."""
        time = (
            np.arange(start // NANOSECONDS, -(-end // NANOSECONDS) + 1, dtype=np.int64)
            * NANOSECONDS
        )
        return WindSeries(
            time=time,
            channels={"wind_speed": np.full(len(time), self.speed)},
            flags=np.zeros(len(time), dtype=np.uint16),
            sensor=Sensor(
                name="declared constant wind",
                averaging=0.0,
                distance_constant=0.0,
                accuracy=self.sigma,
            ),
        )


def declared_recording(
    lake: Lake,
    camera: Artifact,
    wind: ConstantWind,
    *,
    recipe: Mapping[str, Any] | None = None,
    findings: tuple[Finding, ...] = (),
    parameters: Mapping[str, float | str] | None = None,
    name: str | None = None,
    session: str | None = None,
    branch: str = "main",
    progress: Progress | None = None,
) -> tuple[Artifact, RecordingResult]:
    """Makes the wind artifact and the recording of a film in a declared wind, in one commit;
    returns what is there where it is there.

    Args:
        recipe: what else the recording's identity depends on.
        findings, parameters: see `flagdata.align.film_recording.Alignment`.
        name: what people call the recording; the camera's name if `None`.
        session: one set-up at one place; the camera's if `None`.
        progress: called with 1 for each frame copied.

    Raises:
        UsageError: `camera` is no camera artifact.
        ConflictError: the recording is there under another name or session.
    """
    if camera.kind is not Kind.CAMERA or camera.start is None or camera.end is None:
        raise UsageError(
            f"{camera.name!r} is a {camera.kind}, not a camera",
            where=camera.id,
            fix="flagdata declare CAMERA takes a camera artifact; see flagdata ls",
        )

    def alignment(pair: Pair) -> Alignment:
        start, end = pair.span
        clock = by_stamps(camera.name, pair.wind.name, start=start, end=end, sigma=SAME_CLOCK)
        return Alignment(
            clock=clock,
            recipe={**wind.recipe(), **(recipe or {})},
            findings=findings,
            parameters=parameters or {},
            details={"method": clock.method, "offset": 0.0, "sigma": SAME_CLOCK, "confidence": 1.0},
        )

    present = find_made(
        lake,
        Kind.WIND,
        {"camera": camera},
        wind.recipe(),
        noun="declared wind",
        name=None,
        session=None,
        branch=branch,
    )
    if present.whole is not None:
        pair = Pair.opened(lake, camera, present.whole)
        result = make_recording(
            lake,
            pair,
            alignment(pair),
            name=name,
            session=session,
            branch=branch,
            progress=progress,
        )
        return present.whole, result
    with lake.transaction(f"declare the wind of {camera.name}", branch=branch) as transaction:
        wind_artifact = _add_wind(
            transaction, camera, wind, session=session or camera.session, code=present.code
        )
        pair = Pair.opened(lake, camera, wind_artifact)
        recording = add_recording(
            lake,
            transaction,
            pair,
            alignment(pair),
            name=name,
            session=session_of(pair, session_given=session),
            code=present.code,
            progress=progress,
        )
    return transaction.result.artifacts[wind_artifact.id], recording_result(transaction, recording)


def _add_wind(
    transaction: Transaction,
    camera: Artifact,
    wind: ConstantWind,
    *,
    session: str | None,
    code: str,
) -> Artifact:
    """Write the wind artifact of a film in a declared wind for a transaction."""
    recipe = wind.recipe()
    before, after = round(MARGIN_BEFORE * NANOSECONDS), round(MARGIN_AFTER * NANOSECONDS)
    series = wind.series(cast(int, camera.start) - before, cast(int, camera.end) + after)
    finding = Finding(
        kind=DECLARED,
        severity=Severity.WARNING,
        value=wind.speed,
        what=f"the wind was not measured, but declared to be {wind.speed:g} ± {wind.sigma:g} m/s "
        "all along",
    )
    start, end = int(series.time[0]), int(series.time[-1])
    report = {
        "schema": REPORT_SCHEMA,
        "kind": Kind.WIND.value,
        "speed": wind.speed,
        "sigma": wind.sigma,
        "start": iso(start),
        "end": iso(end),
        "findings": [json_values(finding)],
    }
    staged = transaction.staging(".mcap")
    with RecordWriter(
        staged, metadata={PROVENANCE: provenance({"camera": camera}, recipe, code=code)}
    ) as record:
        record.wind(series)
    artifact = Artifact(
        kind=Kind.WIND,
        name=f"{camera.name} declared wind",
        object=transaction.put(staged),
        parents=(camera.id,),
        recipe=recipe,
        session=session,
        day=iso(start)[:10],
        start=start,
        end=end,
        rate=1.0,
        quality=quality_flags((finding,)),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )
    transaction.add(artifact)
    return artifact
