"""Power cuts beside verbs, and that the study of them finds a flush that is missing."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.contract.imports import ROOT
from tests.studies.failing.disk import Disk, State, read, write
from tests.studies.failing.recorder import Recorder, can_record

pytestmark = pytest.mark.skipif(
    not can_record(), reason="calls are recorded by a library of C that Linux loads first"
)

PUBLISH = """
import os, sys
folder, steps = sys.argv[1], sys.argv[2].split()
def flush(path):
    descriptor = os.open(path, os.O_RDONLY)
    os.fsync(descriptor)
    os.close(descriptor)
if "publish" in steps:
    with open(f"{folder}/scratch", "wb") as file:
        file.write(b"what is " * 512)
        file.write(b"acknowledged" * 512)
    if "file" in steps: flush(f"{folder}/scratch")
    os.rename(f"{folder}/scratch", f"{folder}/inside/new")
if "delete" in steps:
    os.unlink(f"{folder}/inside/old")
if "folder" in steps: flush(f"{folder}/inside")
print("done")
"""
NEW = b"what is " * 512 + b"acknowledged" * 512


@pytest.fixture
def work(tmp_path: Path) -> Path:
    folder = tmp_path.resolve() / "work"
    (folder / "inside").mkdir(parents=True)
    (folder / "inside" / "old").write_bytes(b"before")
    return folder


@pytest.fixture
def recorder(tmp_path: Path) -> Recorder:
    (tmp_path / "recorder").mkdir()
    return Recorder(tmp_path / "recorder")


def answered(recorder: Recorder, folder: Path, program: str, *words: str) -> list[State]:
    """The states that a power cut may leave once a program has answered."""
    disk = Disk(folder)
    done = recorder.record(["-c", program, str(folder), *words], folder)
    assert done.code == 0, done.stderr
    assert done.answered < len(done.calls)
    for call in done.calls[: done.answered]:
        disk.make(call)
    assert disk.seen() == read(folder)
    return list(disk.states(np.random.default_rng(0)))


@pytest.mark.parametrize(
    "steps", ["publish file folder", "delete folder", "publish file delete folder"]
)
def test_of_a_program_that_flushes_all_nothing_that_it_answered_is_lost(
    steps: str, work: Path, recorder: Recorder
) -> None:
    for state in answered(recorder, work, PUBLISH, steps):
        assert state.tree.get("inside/new") == (NEW if "publish" in steps else None), state.kind
        assert ("inside/old" in state.tree) == ("delete" not in steps), state.kind


@pytest.mark.parametrize("steps", ["publish folder", "publish file", "publish"])
def test_a_flush_that_a_program_lacks_is_found_by_what_is_lost_without_it(
    steps: str, work: Path, recorder: Recorder
) -> None:
    states = answered(recorder, work, PUBLISH, steps)
    left = {state.tree.get("inside/new") for state in states}
    assert NEW in left
    if "file" not in steps:
        assert {b"", bytes(len(NEW))} < left  # no bytes, or zeros in their place
        assert any(content and len(content) < len(NEW) for content in left)
    if "folder" not in steps:
        assert None in left


def test_a_deletion_whose_folder_is_not_flushed_may_be_undone(
    work: Path, recorder: Recorder
) -> None:
    states = answered(recorder, work, PUBLISH, "delete")
    assert {"inside/old" in state.tree for state in states} == {True, False}


def test_a_file_system_that_keeps_entries_in_order_never_has_a_later_one_without_those_before(
    work: Path, recorder: Recorder
) -> None:
    program = (
        "import os, sys\nfor name in 'abcdef': os.mkdir(f'{sys.argv[1]}/{name}')\nprint('done')"
    )
    states = answered(recorder, work, program)
    names = [
        sorted(path for path in state.tree if len(path) == 1) for state in states if state.ordered
    ]
    assert all("".join(found) == "abcdef"[: len(found)] for found in names)
    assert any("".join(found) != "abcdef"[: len(found)] for found in _names(states))


def _names(states: list[State]) -> list[list[str]]:
    return [sorted(path for path in state.tree if len(path) == 1) for state in states]


def test_all_ways_to_change_a_folder_are_recorded(work: Path, recorder: Recorder) -> None:
    program = """
import os, shutil, subprocess, sys, tempfile, threading
folder = sys.argv[1]
os.chdir(folder)
with open("large", "wb") as file: file.write(bytes(range(256)) * 1000)
shutil.copyfile("large", "copy")
source, target = os.open("large", os.O_RDONLY), os.open("ranges", os.O_CREAT | os.O_RDWR)
os.copy_file_range(source, target, 5000, 100, 10)
os.pwrite(target, b"in the middle", 2000)
os.writev(target, [b"one", b"two"])
os.truncate("copy", 1000)
os.posix_fallocate(target, 0, 9000)
os.link("ranges", "linked")
with tempfile.TemporaryFile(dir=folder) as file: file.write(b"of no name")
with open("large", "r+b") as file: file.seek(0, 2); file.write(b"the end")
with open("inside/old", "wb") as file: file.write(b"other bytes")
def write(number):
    for turn in range(20):
        with open(f"thread-{number}", "ab") as file: file.write(b"%d" % turn)
threads = [threading.Thread(target=write, args=(number,)) for number in range(3)]
for thread in threads: thread.start()
for thread in threads: thread.join()
subprocess.run([sys.executable, "-c", "open('by-a-child', 'w').write('child')"], check=True)
os.makedirs("a/b/c")
os.replace("copy", "a/b/copy")
os.rename("a/b", "moved")
shutil.rmtree("a")
fd = os.open("inside", os.O_RDONLY)
os.rename("old", "older", src_dir_fd=fd, dst_dir_fd=fd)
print("done")
"""
    for state in answered(recorder, work, program):
        folder = work.with_name("again")
        write(state.tree, folder)
        assert read(folder) == state.tree
        subprocess.run(["rm", "-r", str(folder)], check=True)


STUDY = """
import sys
from dataclasses import replace
from pathlib import Path
from flagdata.ingest import ingest_camera
from flagdata.lake import Lake
from tests.studies.failing import power_cut, recorder, verbs
from tests.studies.failing.scenes import Scene
scratch = Path(sys.argv[1])
def scene(folder):
    lake = Lake.create(folder / "lake")
    camera = ingest_camera(lake, Path(sys.argv[2])).artifact
    lake.tag("v0")
    return Scene(folder=folder, ids={"camera": camera.id})
class Deaf(recorder.Recorder):
    def record(self, *arguments, **options):
        done = super().record(*arguments, **options)
        return replace(done, calls=tuple(call for call in done.calls if call.act is not recorder.Act.FLUSH))
power_cut.ALL = {"small": (scene, verbs.CORE)}
def study(disk, *names):
    (scratch / disk).mkdir()
    options = {"points": 6, "seed": 1, "scenes": scratch / "scenes", "scratch": scratch / disk}
    power_cut.campaign(names, scratch / f"{disk}.json", **options)
study("good", "label", "tag")
power_cut.Recorder = Deaf
study("deaf", "tag")
"""


def test_what_verbs_answered_is_there_after_a_power_cut_and_the_study_finds_what_a_deaf_disk_loses(
    tmp_path: Path, video: Path
) -> None:
    scratch = tmp_path.resolve()
    command = [sys.executable, "-c", STUDY, str(scratch), str(video)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    good, deaf = (json.loads((scratch / f"{disk}.json").read_text()) for disk in ("good", "deaf"))
    assert good.keys() == {"label", "tag"}
    for result in good.values():
        assert (result["examined"], result["wrong"]) == (6, 0), result["examples"]
    assert deaf["tag"]["kinds"]["lost"] > 0
