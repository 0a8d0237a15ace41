"""Two wind artifacts of one wind made one clock: the sensor's log written anew on the reference's
clock, in one commit.

The new artifact is a wind artifact like any other, whose parents are the reference and the sensor.
Its record holds the sensor's samples with the reference's instants as log times and its own stamps
as publish times. Values stay as the
sensor gave them: the gain is reported, not applied. The vendor's file stays attached to the parent.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flagdata.align.logs import LogClock
from flagdata.align.present import find_made, provenance
from flagdata.core.clock_model import NINETY
from flagdata.core.schema import Kind
from flagdata.errors import InputError, UsageError
from flagdata.lake import Artifact, Lake
from flagdata.lake.remaking import Present, Remade
from flagdata.record import Record, RecordWriter
from flagdata.record.metadata import PROVENANCE
from flagdata.record.signals import WindSeries
from flagdata.timebase import iso

REPORT_SCHEMA = "flagdata.align-logs-report/1"


@dataclass(frozen=True, kw_only=True)
class WindPair:
    """A reference and a sensor of one lake."""

    reference: Artifact
    sensor: Artifact
    reference_series: WindSeries
    sensor_series: WindSeries

    @classmethod
    def of(cls, lake: Lake, reference: str, sensor: str, *, at: str | None = None) -> WindPair:
        """Look both up, see `Lake.artifact`.

        Raises:
            UsageError: artifacts of other kinds, or one artifact twice.
            InputError: one holds no samples.
        """
        artifacts = [
            lake.artifact(identity, at=at, kinds=(Kind.WIND,)) for identity in (reference, sensor)
        ]
        for artifact in artifacts:
            if artifact.kind is not Kind.WIND or artifact.object is None:
                raise UsageError(
                    f"{artifact.name!r} is a {artifact.kind}, not a wind",
                    where=artifact.id,
                    fix="flagdata align REFERENCE SENSOR takes two wind artifacts; see flagdata ls",
                )
        if artifacts[0].id == artifacts[1].id:
            raise UsageError(
                "both names are of the same wind artifact",
                where=artifacts[0].id,
                fix="name two wind artifacts",
            )
        series = []
        for artifact in artifacts:
            samples = Record.open(lake.record_place(str(artifact.object))).wind()
            if samples is None or not len(samples):
                raise InputError(
                    "the wind artifact holds no samples",
                    where=artifact.id,
                    fix="ingest the log anew",
                )
            series.append(samples)
        return cls(
            reference=artifacts[0],
            sensor=artifacts[1],
            reference_series=series[0],
            sensor_series=series[1],
        )

    @property
    def parents(self) -> dict[str, Artifact]:
        """Both artifacts by what they are, in the order of an aligned log's parents."""
        return {"reference": self.reference, "sensor": self.sensor}

    @property
    def names(self) -> tuple[str, str]:
        return self.reference.name, self.sensor.name


def find_aligned(
    lake: Lake,
    pair: WindPair,
    recipe: Mapping[str, Any],
    *,
    name: str | None,
    session: str | None,
    branch: str,
) -> Present:
    """Finds what the branch has of the artifact that these parents and options make.

    Raises:
        ConflictError: it is, under another name or session than the one asked for.
    """
    return find_made(
        lake,
        Kind.WIND,
        pair.parents,
        recipe,
        noun="aligned log",
        name=name,
        session=session,
        branch=branch,
    )


def make_aligned(
    lake: Lake,
    pair: WindPair,
    log_clock: LogClock,
    *,
    recipe: Mapping[str, Any],
    name: str | None,
    session: str | None,
    branch: str,
    code: str,
) -> tuple[Artifact, Remade | None]:
    """Write the sensor's log on the reference's clock and publish it in one commit.

    Args:
        code: version of the code that made it, for its record.
        name: what people call it; the sensor's name if `None`.
        session: one set-up at one place; the sensor's if `None`.

    Returns:
        its row, and what was done where its object was damaged or missing.
    """
    clock, sensor_time = log_clock.model, pair.sensor_series.time
    metadata = {PROVENANCE: provenance(pair.parents, recipe, code=code)}
    with lake.transaction(
        f"align {pair.sensor.name} with {pair.reference.name}", branch=branch
    ) as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata=metadata) as record:
            record.wind(pair.sensor_series, clock=clock)
        common = clock.to_common(sensor_time)
        middle = int(sensor_time[0] + (sensor_time[-1] - sensor_time[0]) // 2)
        start, end = int(common[0]), int(common[-1])
        report = {
            "schema": REPORT_SCHEMA,
            "kind": Kind.WIND.value,
            "samples": len(sensor_time),
            "start": iso(start),
            "end": iso(end),
            **summary(log_clock),
        }
        artifact = Artifact(
            kind=Kind.WIND,
            name=name or pair.sensor.name,
            object=transaction.put(staged),
            parents=(pair.reference.id, pair.sensor.id),
            recipe=recipe,
            session=session or pair.sensor.session,
            day=iso(start)[:10],
            start=start,
            end=end,
            rate=pair.sensor.rate,
            clock_method=clock.method,
            clock_offset=float(clock.to_common(middle) - middle) * 1e-9,
            clock_drift=clock.segments[0].drift,
            clock_sigma=float(clock.sigma(middle)),
            clock_model=clock.to_json(),
            quality=pair.sensor.quality,
            report=json.dumps(report, allow_nan=False, ensure_ascii=False),
        )
        transaction.add(artifact)
    return transaction.result.artifacts[artifact.id], transaction.result.healed.get(artifact.id)


def summary(log_clock: LogClock) -> dict[str, Any]:
    """Returns the numbers for JSON: of the sensor's clock on the reference's, and of its gain;
    `drift_parts` is 0 where the drift is a prior's."""
    (segment,) = log_clock.model.segments
    half = NINETY * segment.sigma_offset
    gain = log_clock.gain
    return {
        "method": log_clock.model.method,
        "offset": segment.offset,
        "at": iso(segment.origin),
        "sigma": segment.sigma_offset,
        "interval": [segment.offset - half, segment.offset + half],
        "level": 0.9,
        "confidence": log_clock.model.confidence,
        "drift": segment.drift,
        "drift_sigma": segment.sigma_drift,
        "drift_parts": len(log_clock.line.parts),
        "gain": gain.gain,
        "gain_sigma": gain.sigma,
        "zero": gain.zero,
        "zero_sigma": gain.sigma_zero,
        "gain_minutes": gain.count,
    }
