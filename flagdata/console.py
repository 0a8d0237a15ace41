"""The command line's manners: results on stdout, all else on stderr, JSON with a schema tag, exit codes."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import click

from flagdata.errors import FlagdataError

F = TypeVar("F", bound=Callable[..., Any])


def json_option(command: F) -> F:
    """Adds `--json` (argument `as_json`); errors are then printed as JSON too."""
    return click.option("--json", "as_json", is_flag=True, help="One JSON document on stdout.")(command)


def lake_option(command: F) -> F:
    """Adds `--lake DIR` (argument `lake_path`), also read from the environment variable FLAGDATA_LAKE."""
    return click.option(
        "--lake", "lake_path", envvar="FLAGDATA_LAKE", default=".", show_default=True, metavar="DIR",
        help="The lake's folder; also FLAGDATA_LAKE.",
    )(command)  # fmt: skip


def document(tag: str, content: Mapping[str, Any]) -> None:
    """Print one JSON document, tagged "flagdata.<tag>/1"."""
    click.echo(json.dumps({"schema": f"flagdata.{tag}/1", **content}, indent=2, allow_nan=False, ensure_ascii=False))


def say(text: str) -> None:
    """A line for people, on stderr."""
    click.echo(text, err=True)


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Aligned columns on stdout; numbers to the right."""
    body = [["" if cell is None else str(cell) for cell in row] for row in rows]
    widths = [max(len(r[i]) for r in [list(header), *body]) for i in range(len(header))]
    numeric = [all(_is_number(r[i]) for r in body if r[i]) and bool(body) for i in range(len(header))]
    for row in [list(header), *body]:
        cells = [c.rjust(w) if n else c.ljust(w) for c, w, n in zip(row, widths, numeric, strict=True)]
        click.echo("  ".join(cells).rstrip())


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@contextmanager
def progress(total: int | None, *, label: str, unit: str) -> Iterator[Callable[[int], None]]:
    """A bar on stderr for anything that takes longer than two seconds; yields a function that advances it."""
    from tqdm import tqdm

    interval = 0.2 if sys.stderr.isatty() else 10.0  # a log file gets a line now and then, not an animation
    with tqdm(total=total, desc=label, unit=unit, delay=2, mininterval=interval, file=sys.stderr, ncols=100) as bar:

        def advance(count: int = 1) -> None:
            bar.update(count)

        yield advance


def fail(error: FlagdataError, *, as_json: bool) -> int:
    """Report an error the way the command's user asked for; returns the exit code."""
    if as_json:
        document("error", error.as_dict())
    say(f"flagdata: {error.what}")
    if error.where:
        say(f"  where: {error.where}")
    say(f"  fix:   {error.fix}")
    return error.exit_code
