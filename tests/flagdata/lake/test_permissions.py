"""A lake that one may not read, and folders that cannot hold one: what, where and the fix, never a
traceback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from flagdata.errors import UsageError
from flagdata.lake import Lake
from tests.flagdata.lake.conftest import LINKS, put_text
from tests.program import invoke

NOBODY = 65534
COMMANDS = (["ls"], ["doctor"], ["verify"], ["tag", "v1"], ["log"])
# One process that imports everything, and a child of it for each command, which may not read what
# is closed.
_AS_NOBODY = """
import json, os, resource, sys, zoneinfo
import flagdata.commands.lake_versions, flagdata.commands.upkeep, flagdata.dataset.tagged
import flagdata.ingest.before, flagdata.lake.health, tqdm, xml
from flagdata.cli import main
from tests.program import invoke
for arguments in json.loads(sys.argv[1]):
    child = os.fork()
    if child == 0:
        os.dup2(1, 2)
        if os.getuid() == 0:
            os.setgroups([])
            os.setgid({nobody})
            os.setuid({nobody})
        main(arguments)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print("code", code, arguments[0], flush=True)
"""


@pytest.fixture
def forbidden(lake: Lake) -> Path:
    put_text(lake, "a")
    for folder in (lake.path, *lake.path.parents):
        if folder.owner() == Path.home().owner() and str(folder).startswith("/tmp/"):
            folder.chmod(folder.stat().st_mode | 0o755)
    return lake.path


def as_nobody(commands: Sequence[list[str]]) -> dict[str, tuple[int, str]]:
    """Command → its exit code and all it printed."""
    code = _AS_NOBODY.format(nobody=NOBODY)
    ended = subprocess.run(
        [sys.executable, "-c", code, json.dumps(commands)],
        capture_output=True,
        text=True,
        timeout=500,
        check=True,
    )
    found: dict[str, tuple[int, str]] = {}
    said: list[str] = []
    for line in ended.stdout.splitlines():
        if line.startswith("code "):
            _, number, name = line.split()
            found[name] = (int(number), "\n".join(said))
            said = []
        else:
            said.append(line)
    return found


@pytest.mark.disk(LINKS)
@pytest.mark.parametrize("part", ["lake.json", "catalog/_delta_log", "refs/tags", "mcap"])
def test_each_command_says_what_may_not_be_read(forbidden: Path, part: str) -> None:
    closed = forbidden / part
    before = closed.stat().st_mode
    closed.chmod(0)
    try:
        ended = as_nobody([[*arguments, "--lake", str(forbidden)] for arguments in COMMANDS])
    finally:
        closed.chmod(before)
    assert set(ended) == {arguments[0] for arguments in COMMANDS}
    for name, (code, said) in ended.items():
        assert "Traceback" not in said, (name, said)
        assert "unforeseen" not in said, (name, said)
        assert code == 0 or "fix:" in said, (name, code, said)
    assert any(code for code, _ in ended.values())


@pytest.mark.parametrize("name", ["a\\b", os.fsdecode(b"a\xff"), "a\udc80b"])
def test_a_folder_that_the_catalog_cannot_work_in_is_refused_by_name(
    tmp_path: Path, name: str
) -> None:
    with pytest.raises(UsageError, match="backslash, or a byte that is not UTF-8"):
        Lake.create(tmp_path / name)
    for more in ([], ["--json"]):
        ended = invoke("init", tmp_path / name, *more)
        assert (ended.code, "rename the folder" in ended.err) == (2, True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "name", ["a\nb", "a\tb", "a\rb", "a\x1b]0;x\x07", "a\x9bb", "a\u2028b"], ids=ascii
)
def test_a_folder_with_a_control_character_is_refused_by_every_verb_that_makes_a_lake(
    tmp_path: Path, name: str
) -> None:
    source = Lake.create(tmp_path / "source").path
    for words in (
        ("init", tmp_path / name),
        ("clone", source, tmp_path / name),
        ("init", tmp_path / name / "lake"),
    ):
        ended = invoke(*map(str, words))
        assert (ended.code, "a tab or another control character" in ended.err) == (2, True), (
            ended.err
        )
    assert list(tmp_path.iterdir()) == [source]


def test_a_path_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for path in (tmp_path / "loop" / "lake", f"{tmp_path}/a\0b"):
        with pytest.raises((UsageError, Exception)) as refused:
            Lake.create(path)
        assert refused.type.__module__ == "flagdata.errors"


_MOUNTED = ["unshare", "--mount", "--map-root-user", "sh", "-c"]
_READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"'
READING = (
    ["ls"],
    ["log"],
    ["doctor"],
    ["verify"],
    ["query", "--where", "kind = 'wind'"],
    ["gc", "--dry-run"],
)
WRITING = (["tag", "v1"], ["gc"], ["withdraw", "a", "-m", "wrong"], ["expire", "--keep", "1"])
_IN_TURN = """
import contextlib, io, json, sys
from flagdata.cli import main
for arguments in json.loads(sys.argv[1]):
    said, code = io.StringIO(), 0
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            main(arguments)
        except SystemExit as ended:
            code = ended.code
    print(json.dumps([arguments[0], code, said.getvalue()]))
"""


@pytest.mark.disk(LINKS)
def test_a_lake_on_a_disk_that_is_mounted_read_only_is_read_and_what_would_write_says_so(
    lake: Lake,
) -> None:
    put_text(lake, "a")
    try:
        subprocess.run(
            [*_MOUNTED, _READ_ONLY, str(lake.path), "true"], capture_output=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        pytest.skip(
            "this system lets nobody mount a folder read-only (unshare --mount --map-root-user)"
        )
    commands = [[*arguments, "--lake", str(lake.path)] for arguments in (*READING, *WRITING)]
    typed = [sys.executable, "-c", _IN_TURN, json.dumps(commands)]
    ended = subprocess.run(
        [*_MOUNTED, _READ_ONLY, str(lake.path), *typed],
        capture_output=True,
        text=True,
        timeout=500,
        check=True,
    )
    outcomes = [json.loads(line) for line in ended.stdout.splitlines()]
    assert [(name, code) for name, code, _ in outcomes[: len(READING)]] == [
        (name, 0) for name, *_ in READING
    ]
    for name, code, said in outcomes[len(READING) :]:
        assert (name, code, "mount its disk writable" in said) == (name, 1, True), said
    assert lake.rows()["name"].to_pylist() == ["a"]
