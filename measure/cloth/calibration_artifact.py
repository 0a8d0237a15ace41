"""A calibration in the lake: the answer, draws of the posterior, and the recordings, in one commit.

Its identity is a hash of what went in: the recordings, the options and the seed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flagdata.core.findings import quality_flags
from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.mesh_sequences import write_plain
from flagdata.lake.results import Placed
from measure.cloth.calibration_result import Calibration
from measure.cloth.cloth_calibration import ANSWER
from measure.cloth.flag_simulation import OBSERVED, VERSION
from measure.film.film_source import FilmReading
from measure.observables.observables_artifact import VERSION as READINGS
from models.conditioning.conditioning import VERSION as CONDITIONED

_FORMAT = 1
_HEAD = "flagdata_calibration"


def artifact(calibration: Calibration, reading: FilmReading, parents: tuple[str, ...]) -> Artifact:
    """Returns the row of a calibration, without its object.

    Args:
        reading: how films were read.
        parents: artifacts that the recordings were read from; none for tables.
    """
    values = {q.name: q.value for q in calibration.cloth.values() if q.value is not None}
    sources = [recording.observed.source for recording in calibration.recordings]
    spans = [
        [recording.observed.first, recording.observed.duration]
        for recording in calibration.recordings
    ]
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=", ".join(recording.observed.name for recording in calibration.recordings),
        parents=parents,
        seed=calibration.options.seed,
        parameters=canonical(values),
        recipe={
            "calibrate": ANSWER,
            "simulations": VERSION,
            "observe": READINGS,
            "conditioned": CONDITIONED,
            "sources": sources,
            "spans": spans,
            **reading.recipe(),
            **calibration.options.recipe(),
        },
        quality=quality_flags(calibration.findings),
        report=canonical({"schema": "flagdata.calibrate-report/1", **calibration.document}),
    )


def keep(
    lake: Lake,
    calibration: Calibration,
    reading: FilmReading,
    parents: tuple[str, ...],
    *,
    branch: str,
) -> Placed:
    """Commit a calibration where it is new, see `flagdata.lake.results`.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    row = artifact(calibration, reading, parents)
    return results.keep(
        lake, row, lambda staged: write(staged, calibration), f"calibrate {row.name}", branch=branch
    )


def write(path: Path, calibration: Calibration) -> None:
    """Writes a new Zarr folder: `cloth` (draw, quantity) where the weight is not withheld, and for
    each recording `readings-N` (window, observable) and `wind-N` (window)."""
    import zarr

    group = zarr.open_group(path, mode="w-", zarr_format=3)
    names = list(calibration.cloth)
    group.update_attributes(
        {
            _HEAD: {"format": _FORMAT},
            "quantities": names,
            "observables": list(OBSERVED),
            "answer": calibration.document,
        }
    )
    if calibration.withheld is None:
        cloth = np.stack([calibration.draws.cloth[name] for name in names], axis=1)
        write_plain(group, "cloth", cloth.astype(np.float32), ("draw", "quantity"))
    for number, recording in enumerate(calibration.recordings):
        write_plain(
            group,
            f"readings-{number}",
            recording.observed.readings.astype(np.float32),
            (f"window-{number}", "observable"),
        )
        write_plain(
            group,
            f"wind-{number}",
            recording.observed.speed.astype(np.float32),
            (f"window-{number}",),
        )
