"""A measurement in the lake: the estimates, the film, the network.

Its identity is a hash of what went in: the film's artifact or content, the network, the options and
the seed. Its object is a Zarr folder with the posterior's draws, the windows' series and the whole
answer as JSON.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.findings import quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.mesh_sequences import check_format, read_part, store_errors, write_plain
from flagdata.lake.results import Placed
from flagdata.timebase import NANOSECONDS
from measure.estimate.film_measuring import Measurement
from measure.estimate.gusty_series import SERIES_KEY
from measure.estimate.wind_by_window import WIND, Beside
from measure.film.film_source import FilmReading, Subject
from measure.measuring_model.networks import Network

_FORMAT = 1
_ANSWER = 4
"""Raised when the same film, network and options get another answer, which is then another
measurement. 2: bounds at the ends of the range, and sizes that are judged one by one. 3: a stated
weight is conditioned on exactly. 4: windows of a film are one gusty series."""
_HEAD = "flagdata_estimate"
REFUSED = "refused-by-gate"
"""Quality flag of what was kept although the gate refused it."""


def artifact(
    measured: Measurement, subject: Subject, network: Network, reading: FilmReading
) -> Artifact:
    """Builds the row of a measurement, without its object."""
    parents = [] if subject.artifact is None else [subject.artifact.id]
    parents += [] if network.artifact is None else [network.artifact.id]
    start = subject.film.start
    estimates = {
        q.name: q for q in measured.quantities if q.constrained and q.value is not None
    }  # no bounds among them
    wind = estimates.get(WIND)
    flags = quality_flags(measured.notices(anyway=True))
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=measured.film,
        parents=parents,
        seed=measured.options.seed,
        source_hash=subject.content_hash(),
        source_name=None if subject.path is None else subject.path.name,
        recipe={
            "measure": _ANSWER,
            "network": network.identity,
            **_series(network),
            **measured.options.recipe(),
            **reading.recipe(),
        },
        start=start,
        end=None if start is None else start + round(measured.duration * NANOSECONDS),
        wind=None if wind is None else wind.value,
        wind_sigma=None if wind is None else wind.sigma,
        parameters=canonical({name: q.value for name, q in estimates.items()}),
        quality=sorted({*flags, REFUSED}) if measured.verdict.refused else flags,
        report=canonical(report(measured)),
    )


def _series(network: Network) -> Mapping[str, Any]:
    """Returns how the network errs in a series of windows; nothing of one whose card does not
    say."""
    entry = network.estimator.card.get(SERIES_KEY)
    return {} if entry is None or network.reading is not None else {SERIES_KEY: entry}


def report(measured: Measurement) -> Mapping[str, Any]:
    """Returns what the row says of it: JSON values."""
    return {
        "schema": "flagdata.measure-report/2",
        "sentence": measured.sentence,
        "model": measured.model,
        "quantities": {q.name: json_values(q) for q in measured.quantities},
        "gate": json_values(measured.verdict),
        "combined": measured.combined,
        "findings": json_values(measured.notices(anyway=True)),
    }


def keep(
    lake: Lake,
    measured: Measurement,
    subject: Subject,
    network: Network,
    reading: FilmReading,
    series: Beside,
    *,
    branch: str,
    refinement: Mapping[str, Any] | None = None,
) -> Placed:
    """Commit a measurement where it is new, see `flagdata.lake.results`.

    Args:
        refinement: what a refinement found, as JSON values.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    return results.keep(
        lake,
        artifact(measured, subject, network, reading),
        lambda staged: write(staged, measured, series, refinement),
        f"measure {measured.film}",
        branch=branch,
    )


def write(
    path: Path, measured: Measurement, series: Beside, refinement: Mapping[str, Any] | None = None
) -> None:
    """Writes a new Zarr folder: `draws` (draw, target) and the columns of the wind series, each
    over `time`.

    Dimensions are named, so that xarray opens it as a data set.
    """
    import zarr

    group = zarr.open_group(path, mode="w-", zarr_format=3)
    group.update_attributes(
        {
            _HEAD: {"format": _FORMAT},
            "targets": list(measured.names),
            "answer": measured.document(anyway=True),
            "series": json_values(series),
            "refinement": None if refinement is None else dict(refinement),
        }
    )
    write_plain(group, "draws", measured.draws.astype(np.float32), ("draw", "target"))
    for name, values in {**series.columns(), "time": series.time}.items():
        write_plain(
            group, name, values.astype(np.float64 if name == "time" else np.float32), ("time",)
        )


def read(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Reads the answer of a measurement's object as JSON values, and its arrays.

    Raises:
        CorruptError: not such a folder, damaged, or of a newer format.
        LimitError: arrays larger than the limits of `flagdata.lake.mesh_sequences`.
    """
    from flagdata.lake.sized_chunks import open_group

    with store_errors(path, "the measurement is damaged", fix="run flagdata verify; measure again"):
        group = open_group(path)
        check_format(group.attrs.get(_HEAD), _FORMAT, path, noun="measurements")
        answer: Any = json.loads(json.dumps(group.attrs["answer"]))
        names = sorted(group.array_keys())
        return answer, {name: read_part(group, name, None, None, where=str(path)) for name in names}
