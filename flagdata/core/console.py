"""The command line's manners: results on stdout, all else on stderr, JSON with a schema tag, exit
codes.

All that a terminal is given goes through this module. Files and lakes of other users name things,
and a name may hold
what a terminal obeys: control characters, marks of direction, line ends that would forge a line.
They are escaped here, so that no command has to think of it.
"""

from __future__ import annotations

import csv
import json
import logging
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import click

from flagdata.core.extras import missing
from flagdata.core.files.addresses import lake_place, local_path
from flagdata.core.findings import Finding
from flagdata.core.json_values import json_values
from flagdata.core.printable import printable, printable_lines
from flagdata.errors import FlagdataError, LimitError, UnforeseenError
from flagdata.storage import Place, StoreError


class LocalPath(click.Path):
    """A path on the command line, a `Path` afterwards; the address of a storage or stream is
    refused as what it is."""

    def __init__(
        self, *, exists: bool = False, file_okay: bool = True, dir_okay: bool = True
    ) -> None:
        super().__init__(
            exists=exists, file_okay=file_okay, dir_okay=dir_okay, readable=False, path_type=Path
        )

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = local_path(value)
        if self.exists:
            with suppress(FileNotFoundError, NotADirectoryError):  # click takes any error for these
                path.stat()
        return super().convert(path, param, ctx)


class LakePlace(click.ParamType):
    """A lake's folder or address on the command line, a `Path` or `RemotePath` afterwards."""

    name = "lake"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Place:
        return lake_place(value)


def document(tag: str, content: Mapping[str, Any]) -> None:
    """Print one JSON document, tagged "flagdata.<tag>/1"."""
    tagged = {"schema": f"flagdata.{tag}/1", **content}
    text = json.dumps(tagged, indent=2, allow_nan=False, ensure_ascii=False)
    if printable_lines(text) != text:  # what stands in a text may be written as \u and its number
        text = json.dumps(tagged, indent=2, allow_nan=False)
    click.echo(text)


def echo(text: object = "") -> None:
    """Writes one line of a result to stdout."""
    click.echo(printable(str(text)))


def echo_lines(text: str, *, aside: bool = False) -> None:
    """Writes a result of several lines; nothing where there is none.

    Args:
        aside: on stderr.
    """
    click.echo(printable_lines(text), nl=bool(text) and not text.endswith("\n"), err=aside)


def csv_rows(rows: Iterable[Sequence[object]]) -> None:
    """Writes a result as CSV: to a file or another program as it is, to a terminal as other
    text."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    if sys.stdout.isatty():
        rows = (
            [printable(cell) if isinstance(cell, str) else cell for cell in row] for row in rows
        )
    writer.writerows(rows)


def ask(question: str) -> str:
    """Asks at the terminal, and returns what is typed, without blanks around it."""
    return str(click.prompt(printable(question), err=True, prompt_suffix="> ")).strip()


_COLOURS = {"warning": "yellow", "error": "red", "flagdata": "red"}


def say(text: str, *, mark: str | None = None) -> None:
    """Writes a text for people to stderr, further lines indented, so that none is taken for a
    message of its own.

    Args:
        mark: "note", "warning" or "error" before it, or "flagdata" before the error that ends a
            command: in colour on a terminal, unless the environment variable NO_COLOR is set.
    """
    message = _indent_lines(text)
    if mark is not None:
        coloured = mark in _COLOURS and not os.environ.get("NO_COLOR")
        message = (
            f"{click.style(f'{mark}:', fg=_COLOURS[mark], bold=True) if coloured else f'{mark}:'} "
            f"{message}"
        )
    click.echo(message, err=True)  # which takes the colour out where stderr is no terminal


def say_finding(finding: Finding) -> None:
    """Writes a finding for people to stderr: what was found, and what to do about it."""
    say(finding.what + (f"; {finding.fix}" if finding.fix else ""), mark=finding.severity.value)


def say_beside_bars(text: str) -> None:
    """Writes a text for people while a bar of `progress` is shown."""
    from tqdm import tqdm  # loads slowly

    tqdm.write(_indent_lines(text), file=sys.stderr)


def _indent_lines(text: str) -> str:
    return printable_lines(text).replace("\n", "\n  ")


class Aside(logging.Handler):
    """Says what the package logs while a command runs."""

    def emit(self, record: logging.LogRecord) -> None:
        echo_lines(record.getMessage(), aside=True)


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Writes aligned columns to stdout; numbers to the right."""
    body = [["" if cell is None else printable(str(cell)) for cell in row] for row in rows]
    header = list(map(printable, header))
    widths = [max(len(r[i]) for r in [header, *body]) for i in range(len(header))]
    numeric = [
        all(_is_number(r[i]) for r in body if r[i]) and bool(body) for i in range(len(header))
    ]
    for row in [header, *body]:
        cells = [
            c.rjust(w) if n else c.ljust(w) for c, w, n in zip(row, widths, numeric, strict=True)
        ]
        click.echo("  ".join(cells).rstrip())


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@contextmanager
def progress(total: int | None, label: str, unit: str) -> Iterator[Callable[[int], None]]:
    """Shows a bar on stderr for anything that takes longer than two seconds; yields a function that
    advances it."""
    from tqdm import tqdm

    interval = (
        0.2 if sys.stderr.isatty() else 10.0
    )  # a log file gets a line now and then, not an animation
    with tqdm(
        total=total,
        desc=printable(label),
        unit=unit,
        delay=2,
        mininterval=interval,
        file=sys.stderr,
        ncols=100,
    ) as bar:

        def advance(count: int = 1) -> None:
            bar.update(count)

        yield advance


def foreseen(error: Exception) -> FlagdataError:
    """Turns any exception that reached the command line into its report."""
    if isinstance(error, FlagdataError):
        return error
    if isinstance(error, ImportError) and (lacking := missing(error)) is not None:
        return lacking
    if isinstance(error, OSError):
        message = " ".join(
            (error.strerror or str(error)).split()
        )  # without strerror where a library of C++ raised it
        return FlagdataError(
            f"the system refused: {message}",
            where=None if error.filename is None else str(error.filename),
            fix=error.fix
            if isinstance(error, StoreError)
            else "check that the file is there, its permissions and the space on the disk",
        )
    if isinstance(error, MemoryError):
        return LimitError(
            "there is not enough memory for this",
            fix="ask for less at a time, or use a larger machine",
        )
    frames = traceback.extract_tb(error.__traceback__)
    places = [location for frame in frames if (location := _own_place(frame)) is not None]
    message = " ".join(f"{type(error).__name__}: {error}".split())
    return UnforeseenError(
        f"an unforeseen error occurred: {message[:300]}",
        where=places[-1] if places else None,
        fix="this is a defect of flagdata: please report it, with what --debug before the "
        "command's name says",
    )


_HOUSE = Path(__file__).resolve().parents[2]


def _own_place(frame: traceback.FrameSummary) -> str | None:
    """Returns file and line within the packages of this project; `None` elsewhere."""
    path = Path(frame.filename)
    if not path.is_relative_to(_HOUSE) or "site-packages" in path.relative_to(_HOUSE).parts:
        return None
    return f"{path.relative_to(_HOUSE)}, line {frame.lineno}"


@contextmanager
def following(published: str, doing: str) -> Iterator[None]:
    """Runs work that follows the publication of `published`: an error in it becomes a warning,
    since that stays published.

    Args:
        published: what was published, e.g. "the data set in lake".
        doing: what the block does, e.g. "writing its card".
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001  the command has done what stays done
        reported = foreseen(error)
        _report(
            f"{published} is published, but {doing} failed: {reported.what}",
            reported,
            mark="warning",
        )


@contextmanager
def in_steps(published: Callable[[], str]) -> Iterator[None]:
    """Runs work that publishes one part after the other: an error in it says which parts are
    published and stay.

    Args:
        published: what is published by now, e.g. "2 recordings on branch main"; "" if nothing is.
    """
    try:
        yield
    except Exception as error:
        reported = foreseen(error)
        try:
            done = published()
        except (OSError, FlagdataError):
            done = "what was finished before (flagdata log lists it)"
        if not done:
            raise
        fix = (
            f"{reported.fix}. Published, and kept: {done}; give the same command again for the rest"
        )
        raise type(reported)(reported.what, where=reported.where, fix=fix) from error


def fail(error: FlagdataError, *, as_json: bool) -> int:
    """Report an error the way the command's user asked for; returns the exit code."""
    if as_json:
        document("error", json_values(error))
    _report(error.what, error)
    return error.exit_code


def _report(text: str, error: FlagdataError, *, mark: str = "flagdata") -> None:
    say(text, mark=mark)
    if error.where:
        say(f"  where: {error.where}")
    say(f"  fix:   {error.fix}")


def print_help(context: click.Context, *, as_json: bool) -> None:
    """Writes the help of a command to stdout."""
    if as_json:
        document("help", {"command": context.command_path, "help": context.get_help()})
    else:
        echo_lines(context.get_help())
