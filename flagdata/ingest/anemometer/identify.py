"""What a file is: of a format by its maker's signature, of a recipe by its heading, a table, or
something else."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

from flagdata.core.files.addresses import local_path
from flagdata.core.files.regular_files import is_beside
from flagdata.errors import FlagdataError, NotFoundError
from flagdata.ingest.anemometer import untimed
from flagdata.ingest.anemometer.containers import json_lines
from flagdata.ingest.anemometer.draft.drafting import Draft
from flagdata.ingest.anemometer.formats.log_formats import FORMATS, SIGNATURES, Format
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, NAMED, SURE, Guess, GuessKind, Head
from flagdata.ingest.anemometer.table.delimited import Delimited, draft_recipe
from flagdata.ingest.anemometer.text.opening import open_text
from flagdata.ingest.anemometer.text.text_file import TextFile, first_bytes, is_workbook, signature
from flagdata.ingest.anemometer.wind_options import Limits, WindOptions
from flagdata.ingest.meshes import others

_PICTURES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp"}
_MESHES = {".obj"}


def open_log(path: Path, options: WindOptions, encoding: str | None = None) -> TextFile:
    """Opens a log as lines: JSON lines as a table, rows that carry no time on the clock that was
    given.

    Raises:
        FlagdataError: it cannot be read as text, or does not fit the options.
    """
    source = open_text(
        path, limits=options.limits, encoding=options.encoding or encoding, topic=options.topic
    )
    first = next((line.strip() for line in source.head() if line.strip()), "")
    flat = first.startswith("{") and first.endswith("}")
    if options.rate is not None:
        table = json_lines.as_table(source) if flat else source
        return untimed.add_times(
            table, rate=options.rate, start=options.start, columns=options.columns
        )
    if (
        not flat
        or options.format is not None
        or options.recipe is not None
        or recognise_file(source)
    ):
        return source
    return json_lines.as_table(source)


def signing_formats(source: TextFile) -> tuple[str, ...]:
    """Formats by which a file's first line names itself."""
    first = "".join(source.head(1)).lstrip("\ufeff")
    return tuple(name for name, marks in SIGNATURES.items() if first.startswith(marks))


def recognise_file(source: TextFile) -> tuple[Guess, ...]:
    """Lists the formats and recipes that know a file, the surest first; none where it is
    unknown."""
    return tuple(guess for guess in _guesses(source) if guess.score >= SURE)


def _guesses(source: TextFile) -> tuple[Guess, ...]:
    head = Head(lines=tuple(source.head(HEAD_LINES)), counted=source.counted)
    candidates: list[Guess] = []
    for _, form in FORMATS.usable(signing_formats(source) or None):
        reader: Format = form()
        guess = reader.recognise(head)
        if guess is not None and guess.score >= NAMED:
            return (guess,)
        if guess is not None:
            candidates.append(guess)
    return tuple(sorted(candidates, key=lambda guess: -guess.score))


def guess_of(draft: Draft) -> Guess:
    """Describes a draft as `sniff` does."""
    return Guess(
        format=Delimited.name,
        score=0.3 if draft.open else 0.55,
        reasons=tuple(fact.line() for fact in draft.facts),
        notes=(f"not used: {', '.join(draft.unused)}",) if draft.unused else (),
        draft=draft.recipe,
        winds=draft.winds,
        doubts=tuple(f"{question.question}: {question.fix()}" for question in draft.open),
        fix="; ".join(question.fix() for question in draft.open) or None,
    )


def sniff(path: Path | str, *, encoding: str | None = None) -> tuple[Guess, ...]:
    """Guesses at what a file or folder is, the likeliest first; never empty.

    Args:
        encoding: of a text, where the file does not show it.

    Raises:
        NotFoundError: there is no such file.
        InputError: it is empty or cannot be read.
    """
    path = local_path(path)
    if not path.exists():
        raise NotFoundError(f"there is no file {path.name}", where=str(path), fix="check the path")
    if path.is_dir():
        return (_folder(path),)
    head = first_bytes(path)
    if mesh := others.format_of(path.name, head):
        return (_other_mesh(f"the file is a {mesh} mesh"),)
    other_file = None if is_workbook(path, head) else signature(head)
    if other_file is not None:
        message, fix = other_file
        kind: GuessKind = (
            "camera" if "video" in message else "record" if "MCAP" in message else "other"
        )
        reason = f"this is {message}: its first bytes are {head[:8].hex(' ')}"
        return (
            Guess(
                format="video" if kind == "camera" else message,
                score=0.99,
                reasons=(reason,),
                kind=kind,
                fix=fix,
            ),
        )
    if path.suffix.lower() in _MESHES:
        reason = f"the name ends in {path.suffix}"
        return (
            Guess(
                format="mesh",
                score=0.9,
                reasons=(reason,),
                kind="meshes",
                fix="ingest the folder it is in",
            ),
        )
    try:
        source = open_log(path, WindOptions(limits=Limits(), encoding=encoding))
        rewritten = tuple(finding.what for finding in source.findings)
        formats = recognise_file(source) or tuple(
            filter(None, [complete_guess(path, WindOptions(encoding=encoding))])
        )
    except FlagdataError as error:
        return (
            Guess(format="unknown", score=0.0, reasons=(error.what,), kind="other", fix=error.fix),
        )
    return tuple(replace(guess, notes=(*rewritten, *guess.notes)) for guess in formats) or (
        unknown(source),
    )


def complete_guess(path: Path | str, options: WindOptions) -> Guess | None:
    """Drafts a table that no recipe describes, with what the user gives; `None` where it is no
    table of a log.

    Raises:
        FlagdataError: the file cannot be read as text.
    """
    draft = draft_recipe(open_log(Path(path), options), options)
    return None if draft is None else guess_of(draft)


def anemometers(path: Path | str, options: WindOptions | None = None) -> tuple[str, ...]:
    """Labels of the anemometers of a table that no recipe describes, where it holds several; else
    none.

    Each can be read by itself: `read_log(path, replace(options, wind=label))`.

    Raises:
        FlagdataError: the file cannot be read as text.
    """
    options = options or WindOptions()
    if (
        options.recipe is not None
        or options.format not in (None, Delimited.name)
        or options.wind is not None
    ):
        return ()
    source = open_log(Path(path), options)
    if options.format is None and options.columns is None and recognise_file(source):
        return ()
    draft = draft_recipe(source, options)
    return draft.winds if draft is not None and len(draft.winds) > 1 else ()


def unknown(source: TextFile) -> Guess:
    """Describes a text that no format and no recipe knows, and that is no table of a time and a
    wind; or what a format says."""
    refused = next((guess for guess in _guesses(source) if guess.fix), None)
    if refused is not None:
        return refused
    text = (
        "its text is neither a table with a time and a wind, nor lines of an instrument that is "
        "known"
    )
    fix = (
        "if it is a log, say what its columns are, in order: --columns "
        '"time[FORMAT],wind_speed[UNIT]"; where none is '
        'a time, and readings came at a steady rate: --columns "wind_speed[UNIT]" --start TIME '
        "--rate HZ; or describe "
        "it by a recipe: --sensor FILE.toml"
    )
    return Guess(format="unknown", score=0.0, reasons=(text,), kind="other", fix=fix)


def _other_mesh(reason: str) -> Guess:
    return Guess(format="mesh", score=0.9, reasons=(reason,), kind="other", fix=others.FIX)


def _folder(path: Path) -> Guess:
    names = [item.name for item in sorted(path.iterdir()) if not is_beside(item.name)]
    meshes = [name for name in names if Path(name).suffix.lower() in _MESHES]
    pictures = [name for name in names if Path(name).suffix.lower() in _PICTURES]
    if meshes and len(meshes) >= len(pictures):
        arcsim = " with an ArcSim conf.json" if "conf.json" in names else ""
        reason = f"a folder of {len(meshes)} mesh files{arcsim}, the first {meshes[0]}"
        return Guess(
            format="mesh folder",
            score=0.95,
            reasons=(reason,),
            kind="meshes",
            fix="ingest it as meshes",
        )
    if pictures:
        reason = f"a folder of {len(pictures)} pictures, the first {pictures[0]}"
        return Guess(
            format="image sequence",
            score=0.9,
            reasons=(reason,),
            kind="camera",
            fix="ingest it as a camera",
        )
    foreign = Counter(filter(None, map(others.format_of, names)))
    if foreign:
        (mesh, count), *_ = foreign.most_common(1)
        return _other_mesh(f"a folder of {count} {mesh} meshes")
    return Guess(
        format="folder",
        score=0.0,
        reasons=(f"a folder of {len(names)} files, neither meshes nor pictures",),
        kind="other",
        fix="give one file, or a folder of PNG, JPEG, TIFF, BMP or WebP pictures",
    )
