"""What a file seems to be, and why: ranked guesses, for anemometer logs and for files that are something else."""

from __future__ import annotations

import datetime as dt
import re
from dataclasses import replace
from pathlib import Path

from flagdata.addresses import local_path
from flagdata.errors import FlagdataError, NotFoundError
from flagdata.ingest.anemometer import foreign
from flagdata.ingest.anemometer.documents import excel
from flagdata.ingest.anemometer.documents.opening import first_bytes, open_text, signature
from flagdata.ingest.anemometer.options import Limits
from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.restating import bulletins, spelled_stamps, untimed
from flagdata.ingest.anemometer.restating.restate import restate
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, Guess, GuessKind, as_taken
from flagdata.ingest.anemometer.tables import numbered_across
from flagdata.ingest.anemometer.tables.drafted_recipe import skeleton
from flagdata.ingest.anemometer.tables.line_kinds import line_kinds
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.signs import SIGNS
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.words.headings import interest

_PICTURES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"}
_MESHES = {".obj", ".ply", ".stl", ".off"}


def sniff(path: Path | str) -> tuple[Guess, ...]:
    """Guesses at what a file or folder is, the likeliest first; never empty.

    Raises:
        NotFoundError: there is no such file.
        InputError: it is empty or cannot be read.
    """
    path = local_path(path)
    if not path.exists():
        raise NotFoundError(f"no file {path.name}", where=str(path), fix="check the path")
    if path.is_dir():
        return (_folder(path),)
    head = first_bytes(path)
    other = None if excel.is_workbook(path, head) else signature(head)
    if other is not None:
        what, fix = other
        kind: GuessKind = "camera" if "video" in what else "record" if "MCAP" in what else "other"
        reason = f"this is {what}: its first bytes are {head[:8].hex(' ')}"
        return (Guess(format="video" if kind == "camera" else what, score=0.99, reasons=(reason,), kind=kind, fix=fix),)
    if path.suffix.lower() in _MESHES:
        reason = f"the name ends in {path.suffix}"
        return (Guess(format="mesh", score=0.9, reasons=(reason,), kind="meshes", fix="ingest the folder it is in"),)
    try:
        opened = open_text(path, limits=Limits())
        if untimed.clocked(opened):
            day = untimed.year_alone(opened)
            dated = untimed.dated(opened, dt.date.fromisoformat(f"2000-{day or '01-01'}"))
            lacks = "date" if day is None else "year"
            return _asking(dated, f"its lines have no {lacks}: give the first day: --date YYYY-{day or 'MM-DD'}")
        if bulletins.matches(opened.head()):
            first = bulletins.first_day(opened)
            dated = bulletins.dated(opened, dt.date.fromisoformat(f"2000-01-{first}"))
            need = f"the bulletins have no month and no year: give the first day in UTC: --date YYYY-MM-{first}"
            return _asking(dated, need)
        if spelled_stamps.spelled(opened.head()):
            return recognise(spelled_stamps.provisional(opened))
        source = restate(opened)
    except FlagdataError as error:
        return (Guess(format="unknown", score=0.0, reasons=(error.what,), kind="other", fix=error.fix),)
    surely = foreign.surely(source.head())
    if surely is not None:
        return (surely,)
    rewritten = tuple(finding.what for finding in source.findings)
    found = tuple(replace(guess, notes=(*rewritten, *guess.notes)) for guess in as_taken(recognise(source)))
    return found or (unknown(source),)


def _asking(dated: TextFile, need: str) -> tuple[Guess, ...]:
    """Guesses at lines that were dated for the time being, with what their user must say of the date.

    A recipe of them would not read the file as it is, and is left out.
    """
    return tuple(replace(guess, needs=(need, *guess.needs), draft=None) for guess in recognise(dated))


def unknown(source: TextFile) -> Guess:
    """What a text is that no format knows, and what its user can do."""
    other = foreign.told(source.head())
    if other is not None:
        return other
    alone = [line for line in source.head(HEAD_LINES) if line.strip()]
    if len(alone) == 1 and sum(interest(cell.strip(' "\ufeff')) > 0 for cell in re.split(r"[,;\t]", alone[0])) > 1:
        text = "a line that names columns of a time or a wind, and no row below it"
        fix = "check that the logger recorded anything, and that the file was copied whole"
        return Guess(format="unknown", score=0.0, reasons=(text,), kind="other", fix=fix)
    across = numbered_across.told(source.head(HEAD_LINES))
    if across is not None:
        return Guess(format="unknown", score=0.0, reasons=(across[0],), kind="other", fix=across[1])
    table = skeleton(source.head(HEAD_LINES))
    if table is not None:
        what, offered, recipe = table
        fix = f"{offered}; {untimed.ADVICE}"
        reason = f"{what}; which of them are the time and the wind, nothing tells"
        return Guess(format="unknown", score=0.0, reasons=(reason,), kind="other", fix=fix, draft=recipe)
    filled = [line for line in source.head(HEAD_LINES) if line.strip()]
    if sum(cell_kind(line) == "number" for line in filled) >= max(2, 0.9 * len(filled)):
        text = "one number a line, and nothing tells what it is or when"
        fix = 'if it is the wind at a steady rate: --columns "wind_speed[m/s]" --start TIME --rate HZ'
        return Guess(format="unknown", score=0.0, reasons=(text,), kind="other", fix=fix)
    text = "text, but neither a table with a time or a wind, nor sentences of a known log in its first lines"
    fix = "if it is a log, export it as a table with one row a reading, or describe it by a recipe: --recipe FILE.toml"
    kinds = next(filter(None, (line_kinds(filled, sign) for sign in SIGNS)), "")
    return Guess(format="unknown", score=0.0, reasons=(text,), kind="other", fix=kinds or fix)


def _folder(path: Path) -> Guess:
    names = [item.name for item in sorted(path.iterdir())]
    meshes = [name for name in names if Path(name).suffix.lower() in _MESHES]
    pictures = [name for name in names if Path(name).suffix.lower() in _PICTURES]
    if meshes and len(meshes) >= len(pictures):
        arcsim = " with an ArcSim conf.json" if "conf.json" in names else ""
        reason = f"a folder of {len(meshes)} mesh files{arcsim}, the first {meshes[0]}"
        return Guess(format="mesh folder", score=0.95, reasons=(reason,), kind="meshes", fix="ingest it as meshes")
    if pictures:
        reason = f"a folder of {len(pictures)} pictures, the first {pictures[0]}"
        return Guess(format="image sequence", score=0.9, reasons=(reason,), kind="camera", fix="ingest it as a camera")
    return Guess(
        format="folder", score=0.0, reasons=(f"a folder of {len(names)} files, neither meshes nor pictures",),
        kind="other", fix="give one file",
    )  # fmt: skip
