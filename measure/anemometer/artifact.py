"""A reading model in the lake: a measurement of its recordings, whose object is a Zarr folder of plain arrays.

Its identity is a hash of what went in: the recordings and their parts, the network, the flag's size and how films were
read.
"""

from __future__ import annotations

from flagdata.findings import quality_flags
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.results import Placed
from flagdata.provenance import canonical
from flagdata.schema import Kind
from measure.anemometer.calibration import ANSWER, Calibrated
from measure.anemometer.features import VERSION
from measure.anemometer.network import CALIBRATED
from measure.anemometer.storage import write
from measure.film.source import Reading
from models.conditioning.conditioning import VERSION as CONDITIONED


def artifact(found: Calibrated, name: str, reading: Reading) -> Artifact:
    """The row of a reading model, without its object.

    Args:
        name: under which `flagdata measure --model` finds it.
        reading: how films were read.
    """
    model = found.model
    spans = [[float(one.features.starts[0]), len(one.features.starts) * model.step] for one in found.recordings]
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=name,
        parents=[one.identity for one in found.recordings],
        recipe={
            CALIBRATED: ANSWER,
            "features": VERSION,
            "conditioned": CONDITIONED,
            "network": model.identity,
            "flag_size": [model.size.length, model.size.height],
            "spans": spans,
            "level": found.level,
            **reading.recipe(),
        },
        quality=quality_flags(found.findings),
        report=canonical({"schema": "flagdata.anemometer-report/1", **found.as_dict()}),
    )


def keep(lake: Lake, found: Calibrated, name: str, reading: Reading, *, branch: str) -> Placed:
    """Commit a reading model where it is new, see `flagdata.lake.results`.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    return results.keep(
        lake,
        artifact(found, name, reading),
        lambda staged: write(staged, found.model, found.as_dict()),
        f"calibrate {name}",
        branch=branch,
    )
