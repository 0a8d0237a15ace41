"""A film of a cloth whose material was measured by itself: a recording whose clips know the cloth,
and maybe the wind.

Where a steady wind is known to an uncertainty it is declared, as `flagdata.align.constant` has it.
Where nobody knows it the recording has frames alone, on the camera's clock, and its clips bear the
quality flag "wind-missing".
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagdata.align.constant import ConstantWind, declared_recording
from flagdata.align.film_recording import (
    RecordingResult,
    copy_frames,
    data_set_of,
    recording_result,
)
from flagdata.align.present import find_made, provenance
from flagdata.core.findings import Finding, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import TRUTH_WINDOW, Kind
from flagdata.dataset.clips import clip_rows
from flagdata.errors import UsageError
from flagdata.lake import Artifact, Lake
from flagdata.recipes.retired_names import hashed_names
from flagdata.record import Record, RecordWriter
from flagdata.record.metadata import CAMERA, PROVENANCE
from flagdata.record.parent import open_parent
from flagdata.timebase import NANOSECONDS, iso

REPORT_SCHEMA = "flagdata.cloth-report/1"
Progress = Callable[[int], object]


@dataclass(frozen=True, kw_only=True)
class ClothFilm:
    """A film of a cloth and what was measured of it.

    Attributes:
        film: the file.
        fabric: its name; films of one fabric are never on two sides of a split.
        area_weight: area weight [kg/m²].
        bending_stiffness: flexural rigidity for each metre of width [N·m]; None if unknown.
        wind_level: a fan's setting, as the table has it; "" if none is stated.
        wind: mean speed and its standard uncertainty [m/s]; None if unknown.
    """

    film: Path
    fabric: str
    area_weight: float
    bending_stiffness: float | None = None
    wind_level: str = ""
    wind: tuple[float, float] | None = None

    @property
    def parameters(self) -> dict[str, float | str]:
        """What the catalog keeps, by the names that simulated recordings have."""
        values: dict[str, float | str] = {"fabric": self.fabric, "area_weight": self.area_weight}
        if self.bending_stiffness is not None:
            values["bending_stiffness"] = self.bending_stiffness
        if self.wind_level:
            values["wind_level"] = self.wind_level
        return values


def cloth_recording(
    lake: Lake,
    camera: Artifact,
    cloth: ClothFilm,
    *,
    branch: str = "main",
    progress: Progress | None = None,
) -> RecordingResult:
    """Makes the recording of a film of a measured cloth and its clips; returns what is there where
    it is there.

    Args:
        camera: the film, ingested.
        cloth: its known properties; the recording's session is its fabric.
        progress: called with 1 for each frame copied.

    Raises:
        UsageError: `camera` is no camera artifact.
        ConflictError: the recording is there under another name or session.
    """
    if camera.kind is not Kind.CAMERA or camera.object is None:
        raise UsageError(
            f"{camera.name!r} is a {camera.kind}, not a camera",
            where=camera.id,
            fix="name a camera artifact; see flagdata ls",
        )
    declaration = Finding.of(
        "cloth-declared",
        f"the cloth is {cloth.fabric}, of {cloth.area_weight:g} kg/m²: measured by itself, as the "
        "table says",
        value=cloth.area_weight,
    )
    if cloth.wind is None:
        return _without_wind(lake, camera, cloth, declaration, branch=branch, progress=progress)
    wind = ConstantWind(speed=cloth.wind[0], sigma=cloth.wind[1])
    _, result = declared_recording(
        lake,
        camera,
        wind,
        recipe=_recipe(cloth),
        findings=(declaration,),
        parameters=cloth.parameters,
        name=camera.name,
        session=cloth.fabric,
        branch=branch,
        progress=progress,
    )
    return result


def _recipe(cloth: ClothFilm) -> dict[str, Any]:
    return {"cloth": hashed_names(cloth.parameters)}


def _without_wind(
    lake: Lake,
    camera: Artifact,
    cloth: ClothFilm,
    declaration: Finding,
    *,
    branch: str,
    progress: Progress | None,
) -> RecordingResult:
    recipe, parents = _recipe(cloth), {"camera": camera}
    present = find_made(
        lake,
        Kind.RECORDING,
        parents,
        recipe,
        noun="recording",
        name=camera.name,
        session=cloth.fabric,
        branch=branch,
    )
    if present.whole is not None:
        rows = lake.rows(
            {"kind": Kind.CLIP, "recording": present.whole.id}, at=branch, columns=["artifact"]
        )
        return RecordingResult(
            recording=present.whole, clips=tuple(rows["artifact"].to_pylist()), created=False
        )
    source = open_parent(lake, str(camera.object))
    times = source.device_frame_times
    start, end = int(times[0]), int(times[-1])
    metadata = {PROVENANCE: provenance(parents, recipe, code=present.code)}
    if CAMERA in source.metadata:
        metadata[CAMERA] = dict(source.metadata[CAMERA])
    report = {
        "schema": REPORT_SCHEMA,
        "kind": Kind.RECORDING.value,
        "frames": len(times),
        "start": iso(start),
        "end": iso(end),
        "findings": [json_values(declaration)],
    }
    with lake.transaction(f"declare the cloth of {camera.name}", branch=branch) as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata=metadata) as record:
            copy_frames(record, source, None, progress=progress)
        recording = Artifact(
            kind=Kind.RECORDING,
            name=camera.name,
            object=transaction.put(staged),
            parents=(camera.id,),
            recipe=recipe,
            session=cloth.fabric,
            **data_set_of(camera),
            day=iso(start)[:10],
            start=start,
            end=end,
            frame_count=len(times),
            rate=(len(times) - 1) * NANOSECONDS / (end - start) if end > start else None,
            parameters=canonical(cloth.parameters),
            quality=sorted({*camera.quality, *quality_flags((declaration,))}),
            report=json.dumps(report, allow_nan=False, ensure_ascii=False),
        )
        transaction.add(recording)
        for clip in clip_rows(
            Record.open(lake.record_place(str(recording.object))), recording, window=TRUTH_WINDOW
        ):
            transaction.add(clip)
    return recording_result(transaction, recording)
