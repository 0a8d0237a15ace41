"""The examples in the docstrings of the calls run, those that need minutes left out: these have
tests of their own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import flagdata
from flagdata.lake import Lake
from sim.run import recipe_of, simulate
from tests.docs.calls import example
from tests.flagdata.conftest import write_video

ELSEWHERE = {
    # minutes
    "measure", "example", "calibrate", "close_loop", "propose", "build", "train", "evaluate",
    "clone", "push", "pull",  # a bucket
    "declare_cloths",  # films of many cloths
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, field_lake: Lake) -> Path:
    """With the files and lakes that the examples name."""
    made = tmp_path_factory.mktemp("examples")
    flag = flagdata.example()
    shutil.copy(flag.film, made)
    shutil.copy(flag.log, made)
    shutil.copytree(field_lake.path, made / "field.lake")
    flagdata.ingest(
        [made / flag.film.name, made / flag.log.name], lake=made / "field.lake", session="monday"
    )
    write_video(made / "tunnel.mp4", frames=130, creation_time="2026-05-01T10:01:10Z")
    flagdata.ingest(made / "tunnel.mp4", lake=made / "field.lake", session="tunnel")
    flagdata.branch("trial", lake=made / "field.lake")
    flagdata.label(["tunnel", "usable=true"], lake=made / "field.lake", branch="trial")
    shutil.copytree(made / "field.lake", made / "backup.lake")
    record = next((made / "field.lake" / "mcap").glob("*.mcap")).read_bytes()
    (made / "cut.mcap").write_bytes(record[: 3 * len(record) // 4])
    (made / "flag.toml").write_text(
        "[scene]\ncolumns = 4\n[wind]\nspeed = 3\n[time]\nsettle = 0\nframes = 2\n"
    )
    recipe = recipe_of(str(made / "flag.toml"), {"material": {"name": "camel-ponte-roma"}})
    simulate(Lake.create(made / "sim.lake"), recipe)
    return made


@pytest.mark.parametrize("name", sorted(set(flagdata.__all__) - ELSEWHERE))
def test_the_example_of_a_call_runs(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    exec(compile(example(name), name, "exec"), {"flagdata": flagdata})
