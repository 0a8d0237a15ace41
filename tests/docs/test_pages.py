"""Every command of the pages runs, on small data made here, in the order in which a reader meets
it."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flagdata
from flagdata.cli import main
from flagdata.errors import InputError
from flagdata.ingest import Head, WindOptions
from flagdata.ingest.anemometer.identify import open_log
from flagdata.lake import Lake
from measure.demo import SENSOR
from tests.docs.pages import DOCS, Shell, blocks, commands, files
from tests.drawn.field import DrawnRecipe, write_drawn_film, write_drawn_log
from tests.drawn.flag import DrawnFlag

OF_INFERENCE = {"loop-markers.md", "proposals.md"}
"""Pages whose commands take minutes each; tests/docs/test_loop_pages.py runs them without the
inference."""
AFTER_START = (
    "alignment.md",
    "measure.md",
    "area-weight.md",
    "long-films.md",
    "hanging-cloth.md",
    "anemometer.md",
    "versions-and-recovery.md",
    "object-storage.md",
    "exports.md",
    "exchange.md",
    "looking.md",
)
ALONE = ("sensors.md", "simulator.md", "datasets.md")
OF_NETWORKS = {"models.md"}
"""The page that builds, trains and judges, which tests/docs/test_models_page.py runs with an
interruption."""
RECIPE = DrawnRecipe(seed=2026, duration=150, clock=-26.24)
"""Its clocks differ as the demonstration's do, whose noted difference `start.md` gives."""
FLAG = DrawnFlag(width=200, height=150, length=95)


def write_small_field(folder: Path, recipe: DrawnRecipe) -> None:
    """Files as the demonstration's, of a small flag that is drawn."""
    write_drawn_log(folder / "anemometer.csv", recipe)
    (folder / "cup-logger.toml").write_text(SENSOR, encoding="utf-8")
    write_drawn_film(
        folder / "flag.mp4", recipe.at_frames(), rate=recipe.rate, seed=recipe.seed, flag=FLAG
    )


def enter(folder: Path, patch: pytest.MonkeyPatch, page: str) -> None:
    """Go into a folder, with the files that the page shows."""
    patch.chdir(folder)
    patch.setenv("FLAGDATA_LAKE", "field.lake")
    for name, text in files(page).items():
        (folder / name).write_text(text, encoding="utf-8")


def withdraw_all_but(count: int, lake_path: Path, where: str) -> None:
    """Leave a command so much to do: it is tested, not what it finds."""
    lake = Lake.open(lake_path)
    found = lake.rows(where, columns=["artifact"])["artifact"].to_pylist()
    assert len(found) > count
    lake.withdraw(found[count:], "of clips that are alike a few are measured")


def run_page(page: str, patch: pytest.MonkeyPatch) -> list[str]:
    shell = Shell(patch=patch)
    return [shell.run(command) for command in commands(page)]


@pytest.fixture(scope="module")
def started(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the commands of start.md ran."""
    folder = tmp_path_factory.mktemp("started")
    write_small_field(folder, RECIPE)
    shutil.copy(
        folder / "flag.mp4", folder / "cloth.mp4"
    )  # what is measured as a cloth: the command is tested
    with pytest.MonkeyPatch.context() as patch:
        enter(folder, patch, "start.md")
        assert "export FLAGDATA_LAKE=field.lake" in commands("start.md")
        run_page("start.md", patch)
    record = next(iter(Lake.open(folder / "field.lake").rows("kind = 'recording'").to_pylist()))
    whole = Lake.open(folder / "field.lake").object_path(record["object"]).read_bytes()
    (folder / "damaged.mcap").write_bytes(whole[: len(whole) // 2])
    return folder


def test_the_five_minute_start_ends_in_a_tagged_recording(started: Path) -> None:
    lake = Lake.open(started / "field.lake")
    (recording,) = lake.rows("kind = 'recording'", at="v1").to_pylist()
    assert recording["clock_method"] == "given"
    assert lake.rows("kind = 'clip'", at="v1").num_rows > 50


def test_the_python_of_the_five_minute_start_runs(
    started: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(started)
    (program,) = blocks("start.md", "python")
    exec(compile(program, "start.md", "exec"), {})
    assert capsys.readouterr().out.startswith("torch.Size([16, 1, 30, 300, 300])")


@pytest.mark.parametrize("page", AFTER_START)
def test_every_command_of_a_page_that_goes_on_from_the_start_runs(
    page: str,
    started: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(started, folder)
    enter(folder, monkeypatch, page)
    if page == "object-storage.md":
        request.getfixturevalue("bucket_folder")
    if page == "long-films.md":
        withdraw_all_but(4, folder / "field.lake", "kind = 'clip' and wind between 4 and 5")
    assert any(run_page(page, monkeypatch))


@pytest.mark.parametrize("page", ALONE)
def test_every_command_of_a_page_that_stands_alone_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    enter(tmp_path, monkeypatch, page)
    if page == "datasets.md":
        Lake.create(tmp_path / "lake")
        for number, row in enumerate(files(page)["fabrics.csv"].splitlines()[1:]):
            write_drawn_film(
                tmp_path / row.split(",")[0],
                np.full(35, 3.0 + number),
                rate=RECIPE.rate,
                seed=RECIPE.seed,
                flag=FLAG,
            )
    assert any(run_page(page, monkeypatch))


def test_the_program_of_the_simulator_page_films_a_flag_beside_its_wind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (name,) = (name for name in files("simulator.md") if name.endswith(".py"))
    exec(compile(files("simulator.md")[name], name, "exec"), {})
    assert flagdata.frames("filmed.mp4").images.shape == (50, 300, 300)
    wind = flagdata.wind("wind.csv")
    assert len(wind.time) == 4


def test_the_transcripts_of_a_draft_are_what_the_program_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    enter(tmp_path, monkeypatch, "sensors.md")
    Lake.create(tmp_path / "field.lake")
    at_terminal, script = blocks("sensors.md", "text")
    first, *refused, accepted = script.splitlines()
    for command, code in ((first, 3), (accepted, 0)):
        with pytest.raises(SystemExit) as ended:
            main(shlex.split(command)[2:])
        assert ended.value.code == code
    printed = "".join(capsys.readouterr())
    transcribed = [*refused, *(line for line in at_terminal.splitlines() if line.startswith("  "))]
    assert [line for line in transcribed if line not in printed and not line.startswith("…")] == []


def test_the_format_of_the_page_reads_its_own_lines(tmp_path: Path) -> None:
    names: dict[str, Any] = {}
    exec(compile(files("wind-formats.md")["calmlog.py"], "calmlog.py", "exec"), names)
    path = tmp_path / "calm.log"
    path.write_text(
        "CALM 2026-05-01T12:00:00Z 4.2\nCALM 2026-05-01T12:00:01Z 4.3\n", encoding="utf-8"
    )
    source = open_log(path, WindOptions())
    reader = names["CalmLog"]()
    assert reader.recognise(Head(lines=tuple(source.head()))).format == "calmlog"
    assert reader.recognise(Head(lines=("time,speed",))) is None
    reading = reader.read(source, WindOptions())
    assert reading.channels["wind_speed"].tolist() == [4.2, 4.3]
    assert np.diff(reading.time).tolist() == [1_000_000_000]
    path.write_text("CALM 2026-05-01T12:00:00Z 4.2\nnonsense\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 2"):
        reader.read(open_log(path, WindOptions()), WindOptions())


def test_no_page_with_commands_is_forgotten() -> None:
    tested = {"start.md", *AFTER_START, *ALONE, *OF_NETWORKS, *OF_INFERENCE}
    assert {page.name for page in DOCS.glob("*.md") if commands(page.name)} == tested
    assert [page for page in tested if len(commands(page)) < 1] == []
