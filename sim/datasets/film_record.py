"""The record of a simulated film: frames, anemometer and parameters in one MCAP file, as a real
recording has them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, recipe_hash
from flagdata.record import RecordWriter
from flagdata.record.metadata import CAMERA, PROVENANCE, camera_metadata
from flagdata.record.signals import CameraInfo, Instants, WindSeries
from flagdata.timebase import NANOSECONDS
from sim.datasets.dataset_films import PlannedFilm
from sim.datasets.dataset_recipe import CameraSpec, Truth
from sim.render.parameters import RenderParameters
from sim.run.members import Member, Parameter

FILL = "fill"
"""Attachment that pads a record to a whole multiple of the camera's `frame_slot`, so that its
length reveals little."""
MEAN_WIND = "mean_wind_speed"


@dataclass(frozen=True, kw_only=True)
class Content:
    """What goes into a record.

    Attributes:
        film: its plan.
        times: (n,) of the frames [UTC ns].
        frames: as the camera codes them.
        wind: the anemometer's samples.
        parameters: numbers by name, SI.
        zeta: render parameters ζ.
        camera: its coding; the record's length is a whole multiple of its slot.
    """

    film: PlannedFilm
    times: Instants
    frames: Sequence[bytes]
    wind: WindSeries
    parameters: Mapping[str, float]
    zeta: RenderParameters
    camera: CameraSpec


def record_bytes(content: Content) -> bytes:
    """Returns the record's bytes. It is written twice: the first one's length gives the padding of
    the second.

    The code's version is in the catalog, not in the file: the same film gives the same bytes.
    """
    with tempfile.TemporaryDirectory(prefix="flagdata-film-") as folder:
        padded = Path(folder) / "whole.mcap"
        _write(Path(folder) / "bare.mcap", content, fill=0)
        size = (Path(folder) / "bare.mcap").stat().st_size
        _write(padded, content, fill=-size % content.camera.frame_slot)
        return padded.read_bytes()


def _write(path: Path, content: Content, *, fill: int) -> None:
    film, zeta, times = content.film, content.zeta, content.times
    row = film.artifact()
    start, end = int(times[0]), int(times[-1])
    rate = (
        (len(times) - 1) * NANOSECONDS / (end - start)
        if len(times) > 1
        else film.cast.simulation.time.rate
    )
    camera = CameraInfo(
        container="render",
        codec=film.filming["renderer"],
        width=zeta.width,
        height=zeta.height,
        container_rate=rate,
        true_rate=rate,
        variable_rate=False,
        rotation=0,
        start=start,
        start_from="simulation",
        duration=(end - start) / NANOSECONDS,
        crop=(0, 0, zeta.width, zeta.height),
    )
    provenance = {
        "meshes": film.sequence,
        "recipe": canonical(row.recipe),
        "recipe_hash": recipe_hash(row.recipe),
    }
    metadata = {PROVENANCE: provenance, CAMERA: camera_metadata(camera)}
    with RecordWriter(path, metadata=metadata, coding=content.camera.coding) as record:
        for time, frame in zip(times.tolist(), content.frames, strict=True):
            record.frame(log_time=time, publish_time=time, timestamp=time, image=frame)
        record.wind(content.wind)
        record.truth(content.parameters, log_time=start)
        record.attach(FILL, bytes(fill), media_type="application/octet-stream", log_time=start)


def parameters_of(
    member: Member, zeta: RenderParameters, drawn: Mapping[str, float], truth: Truth
) -> dict[str, float]:
    """Returns θ, ζ and what the instruments drew, numbers by name in SI; lists as "name.0",
    "name.1", …

    If the anemometer is the ground truth (`Truth.MEASURED`), the simulated mean wind is called
    mean_wind_speed, so that nothing takes it for the truth.
    """
    numbers: dict[str, float] = {}
    for name, value in member.parameters.items():
        numbers |= _numbers(
            MEAN_WIND if name == "wind_speed" and truth is Truth.MEASURED else name, value
        )
    for name, value in json_values(zeta).items():
        numbers |= _numbers(f"render.{name}", value)
    return {**numbers, **drawn}


def _numbers(name: str, value: Parameter) -> dict[str, float]:
    if isinstance(value, str):
        return {}
    if isinstance(value, tuple):
        return {f"{name}.{index}": float(entry) for index, entry in enumerate(value)}
    return {name: float(value)}


def texts_of(member: Member, zeta: RenderParameters) -> dict[str, str]:
    """Returns the parameters that are names."""
    drawn = {f"render.{name}": value for name, value in json_values(zeta).items()}
    return {
        name: value
        for name, value in {**member.parameters, **drawn}.items()
        if isinstance(value, str)
    }
