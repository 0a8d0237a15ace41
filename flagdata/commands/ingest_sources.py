"""What `flagdata ingest` does with each source: into the lake, or a look at what it is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

from flagdata.api.recording_verbs import FromCamera, Ingesting
from flagdata.commands.ingest_options import KINDS, IngestRequest, check_applies
from flagdata.core.console import document, fail, progress, say
from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError, InputError, UsageError

if TYPE_CHECKING:
    from flagdata.ingest.anemometer import Guess
    from flagdata.ingest.anemometer.log_confirmation import Answers
    from flagdata.ingest.artifacts_present import IngestResult
    from flagdata.lake import Lake
from flagdata.commands.ingest_printing import print_results, print_sniffed

Recognised = TypeVar("Recognised")
Done = TypeVar("Done")


def ingest_sources(lake: Lake, given: IngestRequest, *, as_json: bool) -> None:
    """Brings each source into the lake and reports it; exits with 1 where one of several failed.

    Raises:
        FlagdataError: an option that means nothing for any source, or a single source that failed.
    """
    kinds, given = _kinds(given)
    results, failures = _each(
        given.sources,
        kinds,
        lambda source, kind: _one(lake, source, kind, given),
        print_results,
        as_json=as_json,
    )
    if as_json:
        document(
            "ingest",
            {
                "lake": str(lake.path),
                "results": [json_values(result) for of_source in results for result in of_source],
                "failures": _failures(failures),
            },
        )
    _exit_on(failures, given.sources)


def ingest_from_python(chosen: Ingesting) -> tuple[IngestResult, ...]:
    """Brings sources into a lake from Python; see `flagdata.ingest`.

    Raises:
        FlagdataError: see `flagdata.ingest`.
    """
    from flagdata.dataset.lake_source import open_source
    from flagdata.ingest.anemometer.log_confirmation import Accepting

    lake = open_source(chosen.lake).lake
    lake.check_writable()
    kinds, given = _kinds(IngestRequest.of(chosen, confirm=Accepting(accept=chosen.accept)))
    results: list[IngestResult] = []
    for source, kind in zip(given.sources, kinds, strict=True):
        if isinstance(kind, FlagdataError):
            raise kind
        results += _one(lake, source, kind, given)
    return tuple(results)


def _kinds(given: IngestRequest) -> tuple[list[Guess | FlagdataError], IngestRequest]:
    """Returns what each source is, or why it is not recognised; with the options as they are then
    read.

    Raises:
        FlagdataError: an option that means nothing for any source, or a source of another kind than
            all are to be.
    """
    from flagdata.ingest.classification import classify

    log = given.wind.wind

    def kind_of(source: Path) -> Guess:
        kind = classify(
            source,
            format_name=given.format,
            recipe=log.recipe,
            columns=log.columns,
            topic=log.topic or given.camera.camera.topic,
            encoding=log.encoding,
        )
        if given.kind is not None and kind.kind != given.kind:
            raise InputError(
                f"this is {KINDS[kind.kind][0]}, not {KINDS[given.kind][0]}",
                where=str(source),
                fix="leave the kind out, which is then decided by the content",
            )
        return kind

    kinds = _recognise_sources(given.sources, kind_of)
    chapters = given.camera.camera.chapters
    if chapters:
        _check_joined((*given.sources, *chapters), kind_of)
    recognised = [None if isinstance(kind, FlagdataError) else kind.kind for kind in kinds]
    check_applies(recognised, given)
    if "camera" in recognised:
        given = replace(given, wind=replace(given.wind, wind=replace(log, start=None, rate=None)))
    return kinds, given


def _check_joined(paths: Sequence[Path], kind_of: Callable[[Path], Guess]) -> None:
    """Refuse to join what are no films.

    Raises:
        FlagdataError: as `kind_of`; or one of them is something else.
    """
    for path in paths:
        kind = kind_of(path).kind
        if kind != "camera":
            raise UsageError(
                f"{_NOT_JOINED.get(kind, 'what is no film')} cannot be joined with others, only "
                "video files can",
                where=str(path),
                fix=f"ingest each by itself: {command_line('flagdata', 'ingest', *paths)}",
            )


_NOT_JOINED = {
    "anemometer": "a wind log",
    "meshes": "a folder of meshes",
    "markers": "a table of markers",
}


def sniff_sources(given: IngestRequest, *, as_json: bool) -> None:
    """Reports what each source seems to be; exits with 1 where one of several is not recognised.

    Raises:
        FlagdataError: as `ingest_sources`.
    """
    from flagdata.ingest.classification import guesses

    topic, encoding = given.wind.wind.topic, given.wind.wind.encoding
    ranked = _recognise_sources(
        given.sources,
        lambda source: _complete_guesses(
            source, guesses(source, topic=topic, encoding=encoding), given
        ),
    )
    check_applies(
        [None if isinstance(one, FlagdataError) else one[0].kind for one in ranked], given
    )
    entries, failures = _each(
        given.sources,
        ranked,
        lambda source, found: _look(source, found, given),
        print_sniffed,
        as_json=as_json,
    )
    if as_json:
        document("sniff", {"sources": entries, "failures": _failures(failures)})
    _exit_on(failures, given.sources)


def _complete_guesses(
    source: Path, ranked: tuple[Guess, ...], given: IngestRequest
) -> tuple[Guess, ...]:
    """The guesses, a draft among them completed by the options beside --sniff."""
    from flagdata.ingest.anemometer import complete_guess

    wind = given.wind.wind
    if wind.columns is not None and ranked[0].kind in ("anemometer", "other"):
        return (complete_guess(source, wind) or ranked[0], *ranked[1:])
    said = wind.unit is not None or wind.wind is not None or wind.date_order is not None
    if not said or ranked[0].format != "delimited" or ranked[0].recipe is not None:
        return ranked
    return (complete_guess(source, wind) or ranked[0], *ranked[1:])


def _look(source: Path, ranked: Sequence[Guess], given: IngestRequest) -> dict[str, Any]:
    """Guesses at a source; of a camera file, what its headers say and the crop if one was asked
    for."""
    from flagdata.ingest.camera import probe, propose_crop

    entry: dict[str, Any] = {"source": str(source), "guesses": [_guess(guess) for guess in ranked]}
    if ranked[0].kind != "camera":
        return entry
    try:
        entry["camera"] = json_values(probe(source, given.camera.camera))
    except FlagdataError as error:
        entry["problem"] = json_values(error)
        return entry
    if given.camera.camera.crop == "auto":
        proposal = propose_crop(source, given.camera.camera)
        entry["crop"] = {"box": list(proposal.box.as_tuple()), "share": proposal.share}
        with _CropPicture(_picture(given)) as picture:
            picture.write(proposal.picture)
    return entry


def _guess(guess: Guess) -> dict[str, Any]:
    return {
        "kind": guess.kind,
        "format": guess.format,
        "recipe": guess.recipe,
        "score": guess.score,
        "reasons": list(guess.reasons),
        "fix": guess.fix,
        "draft": guess.draft,
        "notes": list(guess.notes),
        "doubts": list(guess.doubts),
        "winds": list(guess.winds),
    }


def _recognise_sources(
    sources: Sequence[Path], recognise: Callable[[Path], Recognised]
) -> list[Recognised | FlagdataError]:
    """What each source is, or why it is not recognised."""

    def of(source: Path) -> Recognised | FlagdataError:
        try:
            return recognise(source)
        except FlagdataError as error:
            return error

    return [of(source) for source in sources]


def _each(
    sources: Sequence[Path],
    recognised: Sequence[Recognised | FlagdataError],
    act: Callable[[Path, Recognised], Done],
    show: Callable[[Done], None],
    *,
    as_json: bool,
) -> tuple[list[Done], list[tuple[Path, FlagdataError]]]:
    """Act on every source in turn and show it; one that fails leaves the others to go on, unless it
    is the only one."""
    results: list[Done] = []
    failures: list[tuple[Path, FlagdataError]] = []
    for source, found in zip(sources, recognised, strict=True):
        try:
            if isinstance(found, FlagdataError):
                raise found
            result = act(source, found)
        except FlagdataError as error:
            if len(sources) == 1:
                raise
            failures.append((source, error))
            if not as_json:
                fail(error, as_json=False)
            continue
        results.append(result)
        if not as_json:
            show(result)
    return results, failures


def _failures(failures: Sequence[tuple[Path, FlagdataError]]) -> list[dict[str, str | None]]:
    return [{"source": str(source), **json_values(error)} for source, error in failures]


def _exit_on(failures: Sequence[tuple[Path, FlagdataError]], sources: Sequence[Path]) -> None:
    """Exit naming what failed, if anything did: with the code of the failures where they agree,
    else with 1."""
    if failures:
        say(
            f"flagdata: {len(failures)} of {len(sources)} sources failed: "
            f"{', '.join(str(s) for s, _ in failures)}"
        )
        codes = {error.exit_code for _, error in failures}
        sys.exit(codes.pop() if len(codes) == 1 else 1)


def _one(lake: Lake, source: Path, kind: Guess, given: IngestRequest) -> tuple[IngestResult, ...]:
    """Artifacts of a source: of a table of markers one a recording, of any other one."""
    from flagdata.ingest.markers.marker_artifacts import ingest_markers
    from flagdata.ingest.records import ingest_record
    from flagdata.ingest.source_artifacts import ingest_camera

    if kind.kind == "record":
        return (ingest_record(lake, source, labels=given.labels, branch=given.chosen.branch),)
    if kind.kind == "markers":
        return ingest_markers(
            lake,
            source,
            given.markers,
            labels=given.labels,
            branch=given.chosen.branch,
            reasons=kind.reasons,
        )
    if kind.kind == "meshes":
        return (_meshes(lake, source, kind, given),)
    if kind.kind != "camera":
        return given.confirm.answered(lambda answers: _winds(lake, source, _with(given, answers)))
    with (
        progress(None, label=source.name, unit="frame") as advance,
        _CropPicture(_picture(given)) as picture,
    ):
        result = ingest_camera(
            lake,
            source,
            given.camera,
            labels=given.labels,
            branch=given.chosen.branch,
            reasons=kind.reasons,
            progress=advance,
            crop_picture=picture.write if _picture(given) else None,
        )
    return (result,)


def _picture(given: IngestRequest) -> Path | None:
    """The file of the picture that shows where the motion is."""
    return given.chosen.crop_picture if isinstance(given.chosen, FromCamera) else None


def _with(given: IngestRequest, answers: Answers) -> IngestRequest:
    """The options with the answers that were typed."""
    options = replace(given.wind.wind, **dict(answers))  # type: ignore[arg-type]
    return replace(given, wind=replace(given.wind, wind=options))


def _winds(lake: Lake, source: Path, given: IngestRequest) -> tuple[IngestResult, ...]:
    """The artifact of a log; of a table that holds several anemometers one of each, named by its
    label.

    An anemometer none of whose values can be used is left out, and the report of the first of the
    others says so.

    Raises:
        NothingMeasuredError: no value of any of them can be used.
    """
    from flagdata.ingest.anemometer import anemometers
    from flagdata.ingest.artifacts_present import IngestResult
    from flagdata.ingest.source_artifacts import ingest_wind, ingest_winds

    found = anemometers(source, given.wind.wind)
    stem = given.labels.name or source.name.removesuffix(".gz").rpartition(".")[0] or source.name
    if not found:
        one, labels = given.wind.wind.wind, given.labels
        if one is not None and len(anemometers(source, replace(given.wind.wind, wind=None))) > 1:
            labels = replace(labels, name=f"{stem}:{one}")
        return (
            ingest_wind(
                lake,
                source,
                given.wind,
                labels=labels,
                branch=given.chosen.branch,
                confirm=given.confirm,
            ),
        )
    each = [
        (
            replace(given.wind, wind=replace(given.wind.wind, wind=label)),
            replace(given.labels, name=f"{stem}:{label}"),
        )
        for label in found
    ]
    done = ingest_winds(lake, source, each, branch=given.chosen.branch, confirm=given.confirm)
    results = [one for one in done if isinstance(one, IngestResult)]
    dead = [
        (label, one)
        for label, one in zip(found, done, strict=True)
        if not isinstance(one, IngestResult)
    ]
    if not results:
        raise dead[0][1]
    left_out = [
        Finding.of(
            "anemometer-left-out",
            f"the anemometer {label!r}: {error.what}",
            where=error.where,
            fix=error.fix,
        )
        for label, error in dead
    ]
    first = results[0]
    report = {**first.report, "findings": [*first.report["findings"], *json_values(left_out)]}
    return (replace(first, report=report), *results[1:])


def _meshes(lake: Lake, source: Path, kind: Guess, given: IngestRequest) -> IngestResult:
    from flagdata.ingest.meshes.mesh_artifacts import ingest_meshes

    with progress(None, label=source.name, unit="mesh") as advance:
        return ingest_meshes(
            lake,
            source,
            given.meshes,
            labels=given.labels,
            branch=given.chosen.branch,
            reasons=kind.reasons,
            progress=advance,
        )


class _CropPicture:
    """The file of --crop-picture; one that was written is removed when the block fails.

    Args:
        path: free, or that of an earlier picture; `None` where no picture was asked for.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._written = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None and self._written and self._path is not None:
            self._path.unlink(missing_ok=True)

    def write(self, data: bytes) -> None:
        """Write the picture.

        Raises:
            ConflictError: another file is there.
            FlagdataError: the disk refuses it.
        """
        from flagdata.core.files.outputs import write_file

        if self._path is None:
            return
        write_file(self._path, data, command="ingest")
        self._written = True
