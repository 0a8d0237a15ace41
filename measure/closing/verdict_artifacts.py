"""A verdict and its models in the lake, in one commit: what was concluded, from which recordings,
by which nulls.

The identity of a verdict is a hash of all that went in (recordings, wind, cloth, options), not of
the files it came in. A measurement's object is a Zarr folder with the verdict's JSON, its report
and the nulls' statistics.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.answer.closed import Closed
from flagdata.core.findings import Finding, quality_flags
from flagdata.core.json_values import json_values
from flagdata.core.provenance import array_hash, canonical, digest, file_hash
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, results
from flagdata.lake.mesh_sequences import check_format, read_part, store_errors, write_plain
from flagdata.lake.results import Placed
from measure.closing.model_recipes import NamedModel, acting
from measure.loop.run import LoopOptions
from measure.nulls.bank import files
from measure.report.document import as_document, from_document
from measure.report.verdict_answer import answer_of_markers
from measure.trajectories import Experiment
from measure.trajectories.trajectory import describe_cloth
from measure.verdict.verdict_record import Candidate, Verdict

_FORMAT = 1
_HEAD = "flagdata_measurement"


@dataclass(frozen=True, kw_only=True)
class Kept:
    """The contents of a commit.

    Attributes:
        measurement: id of the verdict.
        models: ids of its models.
        place: of the verdict among its versions.
    """

    measurement: str
    models: tuple[str, ...]
    place: Placed


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoop:
    """A loop that was closed, of whatever kind of recordings, as it is written and kept.

    Attributes:
        name: what the measurement is called.
        verdict: what came out.
        models: of the verdict.
        effects: whose strengths are kept beside the cloth that was fitted.
        findings: on the recordings.
        answer: the same as an answer.
        recipe: all that went in, JSON values.
        parents: artifacts that the recordings were read from.
        seed: of the verdict.
    """

    name: str
    verdict: Verdict
    models: tuple[NamedModel, ...]
    effects: tuple[Candidate, ...]
    findings: tuple[Finding, ...]
    answer: Closed
    recipe: Mapping[str, Any]
    parents: tuple[str, ...]
    seed: int


def answer_of(
    verdict: Verdict,
    experiment: Experiment,
    options: LoopOptions,
    *,
    name: str,
    models: tuple[NamedModel, ...],
    findings: tuple[Finding, ...],
) -> ClosedLoop:
    """Makes the answer of a verdict on recordings of markers.

    Args:
        name: what the measurement is called.
        models: of the verdict.
        findings: on the recordings.
    """
    bank = None
    if options.bank is not None:
        bank = digest(" ".join(file_hash(path) for path in files(options.bank)))
    recipe = {
        "close-loop": 1,
        "experiment": fingerprint(experiment),
        "level": options.level,
        "nulls": None if options.bank is not None else [options.nulls, options.most_nulls],
        "bank": bank,
    }
    if options.suspected is not None:  # results that were kept before keep their identity
        recipe["suspected"] = options.suspected.words
    return ClosedLoop(
        name=name,
        verdict=verdict,
        models=models,
        effects=acting(verdict),
        findings=findings,
        answer=answer_of_markers(verdict, subject=name, experiment=experiment),
        recipe=recipe,
        parents=tuple(dict.fromkeys(r.source for r in experiment.recordings if r.source)),
        seed=options.seed,
    )


def keep(lake: Lake, closed: ClosedLoop, *, branch: str = "main") -> Kept:
    """Publishes a verdict and its models in one commit where it is new, see
    `flagdata.lake.results`.

    Raises:
        FlagdataError: as `Lake.transaction`.
    """
    entry = results.keep(
        lake,
        _measurement(closed),
        lambda staged: write(staged, closed.verdict, page=closed.answer.page),
        f"close loop: {closed.name}",
        branch=branch,
        derived=lambda verdict: [_model(closed, model, verdict) for model in closed.models],
    )
    verdict = entry.artifact
    ids = tuple(_model(closed, model, verdict).id for model in closed.models)
    models = ids if entry.new else models_of(lake, verdict.id, branch)
    return Kept(measurement=verdict.id, models=models, place=entry)


def models_of(lake: Lake, measurement: str, branch: str) -> tuple[str, ...]:
    """Ids of the models that a measurement left."""
    rows = lake.rows("kind = 'model'", at=branch, columns=["artifact", "parents"]).to_pylist()
    return tuple(row["artifact"] for row in rows if measurement in row["parents"])


def write(path: Path, verdict: Verdict, *, page: str) -> None:
    """Writes a new Zarr folder: `verdict` (UTF-8 JSON), `report` (UTF-8 HTML) and `nulls`
    (statistic of each)."""
    import zarr

    group = zarr.open_group(path, mode="w-", zarr_format=3)
    group.update_attributes(
        {
            _HEAD: {"format": _FORMAT},
            "conclusion": verdict.conclusion.value,
            "named": list(verdict.named),
            "words": verdict.words,
        }
    )
    texts = {"verdict": json.dumps(as_document(verdict), allow_nan=False), "report": page}
    for name, text in texts.items():
        write_plain(group, name, np.frombuffer(text.encode(), dtype=np.uint8))
    write_plain(group, "nulls", np.array(verdict.test.null, dtype=np.float64))


def read(path: Path) -> tuple[Verdict, str]:
    """Reads the verdict and the report of a measurement's object.

    Raises:
        CorruptError: not such a folder, damaged, or of a newer format.
        LimitError: arrays larger than the limits of `flagdata.lake.mesh_sequences`.
    """
    from flagdata.lake.sized_chunks import open_group

    with store_errors(
        path, "the measurement is damaged", fix="run flagdata verify; close the loop again"
    ):
        group = open_group(path)
        check_format(group.attrs.get(_HEAD), _FORMAT, path, noun="verdicts")
        verdict, report = (
            read_part(group, name, None, None, where=str(path)).tobytes().decode()
            for name in ("verdict", "report")
        )
        return from_document(json.loads(verdict)), report


def fingerprint(experiment: Experiment) -> str:
    """Hashes an experiment with its uncertainties, SHA-256: cloth, pins, recordings and wind; not
    of names and files."""
    content, arrays = describe_cloth(experiment.specimen)
    content["recordings"] = [[r.rate, r.noise, *r.wind.uncertainty] for r in experiment.recordings]
    for recording in experiment.recordings:
        arrays += [
            recording.markers,
            recording.positions,
            recording.wind.times,
            recording.wind.velocity,
        ]
        arrays += [] if recording.seen is None else [recording.seen]
    return array_hash(content, arrays)


def _measurement(closed: ClosedLoop) -> Artifact:
    verdict = closed.verdict
    fitted = {p.name: (p.after or p.before).point for p in verdict.parameters}
    fitted |= {
        f"{c.effect}.{c.parameter}": c.strength.point
        for c in closed.effects
        if c.strength.bound is None
    }
    report = {
        "schema": "flagdata.close-loop-report/1",
        "conclusion": verdict.conclusion.value,
        "named": list(verdict.named),
        "words": verdict.words,
        "p_value": verdict.test.p_value.point,
        "separating": verdict.separating,
        "findings": json_values(closed.findings),
    }
    return Artifact(
        kind=Kind.MEASUREMENT,
        name=closed.name,
        parents=closed.parents,
        recipe=dict(closed.recipe),
        seed=closed.seed,
        parameters=canonical(fitted),
        quality=quality_flags(closed.findings),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )


def _model(closed: ClosedLoop, model: NamedModel, measurement: Artifact) -> Artifact:
    effects: Sequence[str] = list(model.content.get("effects", {}))
    report = {"schema": "flagdata.model-report/1", "words": closed.verdict.words, "findings": []}
    return Artifact(
        kind=Kind.MODEL,
        name=model.name,
        parents=(measurement.id, *closed.parents),
        seed=closed.seed,
        recipe={**measurement.recipe, "effects": effects},
        parameters=canonical(model.content),
        report=json.dumps(report, allow_nan=False, ensure_ascii=False),
    )
