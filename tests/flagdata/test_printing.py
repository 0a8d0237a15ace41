"""No command of the program gives a terminal what it would obey, also where other users named what
is printed.

The commands are those of the click tree: one that is added has to be given arguments here.
"""

from __future__ import annotations

import csv
import io
import json
import secrets
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import pyarrow as pa
import pytest

from flagdata.cli import VERBS, root
from flagdata.core import console
from flagdata.core.printable import printable, printable_lines
from flagdata.core.schema import CATALOG, catalog_schema
from flagdata.lake import Lake
from tests.program import invoke

EVIL = (
    "\x1b]0;pwned\x07\x1b[2J\x7f\x9b2J\u202eexe.\u2066\u2028\n      9  cdeadbeef  forged line\r\b"
)
"""Sequences that set the title and clear the screen, in 7 and 8 bits; marks of direction; ends of
lines."""
UNIT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"


def leaves(command: click.Command, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """All commands that do something, by what is typed for them."""
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from leaves(below, (*path, name))
    else:
        yield path


def of_another(folder: Path) -> tuple[Lake, str]:
    """A lake whose rows, messages and labels hold `EVIL`, and the id of a row that does."""
    lake = Lake.create(folder)
    identity = secrets.token_hex(16)
    texts = {name: EVIL for name, column in CATALOG.items() if pa.types.is_string(column.type)}
    json_columns = {"recipe", "parameters", "clock", "report", "calibration"}
    row: dict[str, Any] = dict.fromkeys(CATALOG) | {
        name: text for name, text in texts.items() if name not in json_columns
    }
    row |= {
        "artifact": identity,
        "kind": "wind",
        "branch": "main",
        "object": None,
        "source_hash": "0" * 64,
        "parents": [],
        "quality": [EVIL],
        "format_version": 1,
        "created": 1,
        "dataset": None,
        "side": None,
        "recording": None,
        "recipe": json.dumps({"name": EVIL}),
        "recipe_hash": "0" * 64,
        "report": json.dumps({"findings": [{"severity": EVIL, "kind": EVIL, "what": EVIL}]}),
    }
    good = {**row, "artifact": secrets.token_hex(16), "name": "good", "created": 2}
    table = pa.Table.from_pylist([row, good], schema=catalog_schema())
    info = {
        "commit": "c" + secrets.token_hex(8),
        "message": EVIL,
        "branch": "main",
        "rows": "2",
        "code_version": EVIL,
        "labels": json.dumps({identity: {"who": EVIL}, good["artifact"]: {"who": EVIL}}),
    }
    lake.catalog.append(table, base=lake.catalog.head(), info=info)
    return lake, good["artifact"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with the lake, and files of other users: their names, headers, recipes and values
    hold `EVIL`."""
    folder = tmp_path_factory.mktemp("scene")
    _, identity = of_another(folder / "lake")
    name = EVIL.replace("/", "").replace("\n", " ")
    (folder / "log.csv").write_text(
        f"time,wind_speed {EVIL!r} (m/s),{name}\n2026-05-01T12:00:00Z,5,{name}\n"
    )
    (folder / f"{name}.csv").write_text("time,wind_speed (m/s)\n2026-05-01T12:00:00Z,5\n")
    (folder / "recipe.toml").write_text(
        f'"{json.dumps(EVIL)[1:-1]}" = "{json.dumps(EVIL)[1:-1]}"\n'
    )
    (folder / "film.mcap").write_bytes(b"\x89MCAP0\r\n" + EVIL.encode() * 20)
    (folder / "soup").mkdir()
    (folder / "soup" / "flag_0.obj").write_text(UNIT + f"{name} 1\n")
    np.savez(folder / "arrays.npz", a=np.zeros(3))
    return folder, identity


def calls(folder: Path, identity: str) -> dict[tuple[str, ...], list[list[str]]]:
    """What is typed for each command."""
    lake = ["--lake", str(folder / "lake")]
    names = sorted(path for path in folder.glob("*.csv") if path.name != "log.csv")
    recipe, film, odd = (
        str(folder / "recipe.toml"),
        str(folder / "film.mcap"),
        str(names[0] if names else folder),
    )
    log, out = str(folder / "log.csv"), str(folder / "out")
    return {
        ("ingest",): [
            [log, *lake],
            [odd, *lake],
            [film, *lake],
            [str(folder / "soup"), "--dry-run", *lake],
            [EVIL],
        ],
        ("align",): [[EVIL, EVIL, *lake], [identity, identity, *lake]],
        ("realign",): [[identity, *lake], [EVIL, *lake]],
        ("declare",): [[identity, "--wind", "3", "--sigma", "1", *lake], [EVIL, *lake]],
        ("declare-cloths",): [[log, *lake], [odd, *lake]],
        ("recover",): [[film], [odd]],
        ("ls",): [lake],
        ("show",): [[identity, *lake], [identity, "--all", *lake], [EVIL, *lake]],
        ("lineage",): [[identity, "--details", *lake], [EVIL, *lake]],
        ("view",): [[EVIL]],
        ("query",): [
            [*lake],
            ["--where", "true", "--columns", "name,session,quality", *lake],
            ["--where", EVIL, *lake],
            ["--sql", f"select name as '{EVIL}', * from catalog", *lake],
            ["--sql", "select cast(name as int) from catalog", *lake],
        ],
        ("log",): [lake],
        ("diff",): [["0", "main", *lake], [EVIL, "main", *lake]],
        ("du",): [lake],
        ("catalog",): [[], [EVIL]],
        ("measure",): [[identity, *lake], [film], [odd]],
        ("observe",): [[identity, *lake], [film], [odd]],
        ("calibrate",): [[identity, *lake], [film]],
        ("close-loop",): [[identity, *lake], [recipe], [log]],
        ("propose",): [[identity, *lake], [recipe]],
        ("simulate",): [[recipe, *lake], [EVIL, *lake]],
        ("build",): [[recipe, *lake], [EVIL, *lake]],
        ("train",): [[recipe, *lake], [EVIL, *lake]],
        ("evaluate",): [[EVIL, *lake], [identity, "--at", EVIL, *lake]],
        ("init",): [[str(folder / "lake")], [film]],
        ("tag",): [lake, [EVIL, *lake]],
        ("branch",): [lake, [EVIL, *lake]],
        ("merge",): [[EVIL, *lake]],
        ("label",): [[identity, f"{EVIL}=1", *lake], [identity, f"a={EVIL}", *lake]],
        ("withdraw",): [[EVIL, "-m", EVIL, *lake]],
        ("export",): [
            ["parquet", "--to", out, *lake],
            ["csv", "--to", f"{out}2", *lake],
            [EVIL, "--to", out, *lake],
        ],
        ("push",): [[EVIL, *lake], [film, *lake]],
        ("pull",): [[EVIL, *lake]],
        ("clone",): [[str(folder / "lake"), str(folder / "copy")], [EVIL, out]],
        ("verify",): [lake],
        ("doctor",): [lake, ["--deep", *lake], [film]],
        ("gc",): [["--dry-run", *lake]],
        ("heal",): [[EVIL, *lake], [str(folder / "lake"), *lake]],
        ("expire",): [["--keep", "1", "--dry-run", *lake]],
        ("demo",): [["--out", film]],
        ("blender-setup",): [["--python", EVIL]],
        ("completion",): [["bash"], [EVIL]],
        ("help",): [[], [EVIL]],
    }


def obeyed(text: str) -> set[str]:
    """Characters that move a cursor, turn text round or end a line elsewhere."""
    return {one for one in text if not one.isprintable() and one != "\n"}


COMMANDS = sorted(leaves(root))


def test_every_command_is_called_here() -> None:
    assert set(COMMANDS) == set(calls(Path(), ""))


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_a_command_prints_nothing_that_a_terminal_obeys(
    path: tuple[str, ...], scene: tuple[Path, str]
) -> None:
    assert path[0] in VERBS
    folder, identity = scene
    for arguments in calls(folder, identity)[path]:
        for given in (arguments, [*arguments, "--json"], ["--debug", *arguments]):
            shutil.rmtree(folder / "copy", ignore_errors=True)
            before = ["--debug"] if given[0:1] == ["--debug"] else []
            done = invoke(*before, *path, *given[len(before) :])
            assert obeyed(done.out) == obeyed(done.err) == set(), (path, given)


def test_a_message_of_several_lines_forges_no_line_of_the_log(scene: tuple[Path, str]) -> None:
    folder, _ = scene
    shown = invoke("log", "--lake", folder / "lake")
    assert len(shown.out.splitlines()) == 1 + len(Lake.open(folder / "lake").catalog.history())
    assert printable(EVIL) in shown.out


def test_texts_that_come_from_another_lake_are_reported_and_stay_as_they_are(
    tmp_path: Path,
) -> None:
    of_another(tmp_path / "lake")
    done = invoke("clone", tmp_path / "lake", tmp_path / "copy")
    assert done.code == 0
    assert "control characters" in done.err
    copy = Lake.open(tmp_path / "copy")
    assert set(copy.rows()["name"].to_pylist()) == {EVIL, "good"}
    plain = invoke("push", tmp_path / "copy", "--lake", tmp_path / "lake", "--json")
    assert plain.document["findings"] == []


def test_json_holds_the_same_texts_escaped(scene: tuple[Path, str]) -> None:
    folder, _ = scene
    shown = invoke("log", "--json", "--lake", folder / "lake")
    assert obeyed(shown.out) == set()
    assert EVIL in {commit["message"] for commit in shown.document["commits"]}


@pytest.mark.parametrize("terminal", [True, False])
def test_csv_is_escaped_for_a_terminal_and_left_as_it_is_for_a_file(
    terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = io.StringIO()
    out.isatty = lambda: terminal  # type: ignore[method-assign]
    monkeypatch.setattr(sys, "stdout", out)
    console.csv_rows([[EVIL, 1]])
    (row,) = csv.reader(io.StringIO(out.getvalue(), newline=""))
    assert row == [printable(EVIL) if terminal else EVIL, "1"]


def test_a_message_of_several_lines_is_indented(capsys: pytest.CaptureFixture[str]) -> None:
    console.say("one\ntwo\x1b[2J", mark="warning")
    assert capsys.readouterr().err == "warning: one\n  two\\x1b[2J\n"


def test_what_is_printable_stays_and_lines_stay_lines() -> None:
    plain = "wind 6.2 ± 0.3 m/s, Größe 測定 … µ"
    assert printable(plain) == plain
    assert printable_lines(f"{plain}\n\t{plain}") == f"{plain}\n\\t{plain}"
    assert obeyed(printable_lines(EVIL)) == set()
