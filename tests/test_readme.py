"""The README does what it says: every command in it runs, in order, on what the demonstration
makes."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import tomllib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from PIL import Image, ImageSequence

from docs.generate_example_picture import MOST_BYTES
from flagdata.core.files.outputs import check_folder
from measure.commands.measure import measure
from measure.demo import MINUTES, RecordingRecipe, Story
from measure.demo.demo_command import SCHEMA
from tests.docs.pages import Shell
from tests.pools import Here
from tests.program import invoke

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")

MEASURED = "flagdata measure example:flag"
"""Of the first minute, which has a test of its own."""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    return [
        line[2:]
        for block in blocks("console")
        for line in block.splitlines()
        if line.startswith("$ ")
    ]


def started(command: list[str], *, cwd: Path, **_: object) -> subprocess.CompletedProcess[str]:
    """A command that the demonstration types, run by this process: a start takes longer than its
    work."""
    assert command[1:3] == ["-m", "flagdata.cli"]
    with contextlib.chdir(cwd):
        ended = invoke(*command[3:])
    return subprocess.CompletedProcess(command, ended.code, ended.out)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shortest demonstration, on a coarse mesh, in small pictures."""
    out = tmp_path_factory.mktemp("readme") / "out" / "demo"
    with pytest.MonkeyPatch.context() as patch:
        small = partial(
            RecordingRecipe, rate=25, columns=8, step=8e-3, width=240, rows=180, samples=1
        )
        patch.setattr("measure.demo.story.RecordingRecipe", small)
        patch.setattr("measure.simulated_camera.ProcessPoolExecutor", Here)
        patch.setattr(
            "measure.demo.transcript.subprocess", SimpleNamespace(run=started, PIPE=subprocess.PIPE)
        )
        Shell(patch=patch).run(f"flagdata demo --out {out}")
    return out


def test_the_readme_shows_the_two_commands_that_set_everything_up() -> None:
    assert {"make demo", "make test"} <= set(commands())


@pytest.mark.parametrize(
    "target", sorted({c.split()[1] for c in commands() if c.startswith("make ")})
)
def test_every_make_target_of_the_readme_exists(target: str) -> None:
    subprocess.run(["make", "--dry-run", target], cwd=ROOT, check=True, capture_output=True)


def test_the_demonstration_ends_in_pages_that_need_no_other_folder(folder: Path) -> None:
    """The first page links to one a step, and all pictures are in the pages."""
    index = (folder / "index.html").read_text(encoding="utf-8")
    assert re.findall(r'id="step-(\d)"', index) == list("12345")
    links = re.findall(r"(?:src|href)=\"(?!data:|#)([^\"]*)", index)
    assert links == ["recording.html", "measured.html"]
    for name in links:
        page = (folder / name).read_text(encoding="utf-8")
        assert not re.findall(r"(?:src|href)=\"(?!data:|#)", page)
        assert ".partial" not in page
    assert (folder / "recording.html").read_text(encoding="utf-8").count(
        "data:image/webp;base64,"
    ) == 6


def test_the_demonstration_recovers_the_offset_it_hid(folder: Path) -> None:
    """In the table of truths, inferred or given, with an interval of 90 % that contains the
    truth."""
    index = (folder / "index.html").read_text(encoding="utf-8")
    clock = '<tr><th scope="row">the log&#39;s clock minus the camera&#39;s</th>.*?</tr>'
    (row,) = re.findall(clock, index, re.DOTALL)
    true, found, low, high = (float(number) for number in re.findall(r"[+-]\d+\.\d+", row))
    assert abs(found - true) < 1.0
    assert low <= true <= high
    assert f"<td>{'given' if '--by given' in index else 'right'}</td>" in row


def test_every_command_of_the_readme_runs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bash takes them as they are. They run in this process: a start of the program takes longer
    than its work."""
    given = [
        command for command in commands() if not command.startswith("make ") and command != MEASURED
    ]
    subprocess.run(["bash", "-n", "-c", "\n".join(given)], check=True)
    monkeypatch.chdir(folder.parents[1])
    shell = Shell(patch=monkeypatch)
    printed = [shell.run(command) for command in given]
    assert "healthy" in "".join(printed)
    assert (folder.with_name("field") / "shards" / "manifest.json").exists()


def test_a_user_who_followed_the_readme_can_run_the_demonstration_again(folder: Path) -> None:
    """After the commands: none of them has left anything in its folder, which may therefore be
    replaced."""
    check_folder(folder, schema=SCHEMA)


def test_the_first_minute_prints_what_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    """The command line and the Python of the first screen, each with the block below it."""
    assert MEASURED in commands()
    shown, printed = blocks("text")
    done = CliRunner().invoke(measure, MEASURED.split()[2:])
    assert done.exit_code == 0
    without_bar = re.sub(
        r"\rmeasure:[^\r]*?window\]", "", done.output
    )  # which a slow machine shows
    assert [line for line in without_bar.splitlines() if line] == shown.splitlines()
    (program,) = blocks("python")
    exec(compile(program, "README.md", "exec"), {})
    assert capsys.readouterr().out == printed


def test_the_start_shows_the_same_answer() -> None:
    start = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    assert f"```sh\n{MEASURED}\n```\n\n```text\n{blocks('text')[0]}```" in start


def sheet(name: str) -> Mapping[str, Any]:
    return json.loads((ROOT / "docs" / "results" / f"{name}.json").read_text(encoding="utf-8"))[
        "result"
    ]


def rows() -> dict[str, tuple[str, str]]:
    """What was measured → what it was tested on and what was found, of the table of the first
    screen."""
    table = re.findall(r"^\| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", README, flags=re.MULTILINE)
    return {what: (tested, found) for what, tested, found in table}


@pytest.mark.parametrize(
    ("what", "weight"), [("wind from a film", "open"), ("the same, area weight given", "stated")]
)
def test_the_accuracy_on_films_is_that_of_the_sheet(what: str, weight: str) -> None:
    result = sheet("validate-films")
    films = [film for film in result["films"] if film["part"] == "coverage"]
    errors = result["errors"]["coverage"][weight]
    tested, found = rows()[what]
    if weight == "open":
        winds = [film["wind"] for film in films]
        assert tested.startswith(f"[{len(films)} films]")
        assert f"{min(winds):g} to {max(winds):g} m/s" in tested
        assert errors["bias"] < 0  # "the answer tends to be low"
    covered = errors["covered"]
    refused = result["refused"]["coverage"]["hits"]
    assert found.startswith(
        f"median error {errors['median_error']:.2f} m/s, {covered['hits']} of {covered['count']} in"
    )
    assert found.endswith(f"; {refused} refused" if refused else "intervals")


def test_the_accuracy_of_a_calibrated_flag_is_that_of_the_sheet() -> None:
    first = sheet("validate-anemometer")["networks"]["flow-outdoor"]["films"][0]
    assert (
        rows()["wind from a calibrated flag"][1]
        == f"RMSE {first['read']['cup']['rmse']:.2f} m/s against the cup"
    )


def test_the_accuracy_of_a_weight_is_that_of_the_sheet() -> None:
    result = sheet("validate-weighed")
    films = result["films"]
    flags, codes = films["flags"], {flag["code"] for flag in films["flags"]}
    assert films["withheld"] == 0
    assert codes == {"kernel", "mujoco"}
    assert sum(flag["value"] < flag["truth"] for flag in flags) > 0.8 * len(
        flags
    )  # "most estimates are too low"
    assert rows()["area weight, wind known"] == (
        (
            f"[{len(flags)} films](docs/results/validate-weighed.md) of {result['seconds']:g} s, two "
            "simulators"
        ),
        (
            f"median error {100 * films['median_error']:.0f} %, {films['held']} of {len(flags)} in "
            "their intervals; "
            "most estimates are too low"
        ),
    )


def test_the_refusals_counted_are_those_of_the_sheet() -> None:
    result = sheet("validate-gate-films")
    judging = result["halves"]["judging"]
    refused, right = judging["refused"], judging["right_first"]
    tested, found = rows()["films with a defect"]
    assert tested.startswith(f"[{refused['count']} films]")
    assert tested.endswith(f"{len({film['kind'] for film in result['films']})} kinds")
    assert found == (
        f"{refused['hits']} of {refused['count']} refused, {right['hits']} of them with the true "
        "reason first"
    )


def test_the_films_in_gusts_counted_are_those_of_the_sheets() -> None:
    sheets = [sheet(f"validate-wind-series{seed}") for seed in ("", "-seed-3", "-seed-4")]
    films = sum(one["films"] for one in sheets)
    opened, stated = (
        round(
            sum(
                one["films"] * one["results"][f"{weight}, series"]["mean_covered"] for one in sheets
            )
        )
        for weight in ("open", "stated")
    )
    tested, found = rows()["mean wind in gusts"]
    assert tested.startswith(f"{films} films")
    assert found == f"{opened} in their 90 % intervals; with the area weight given {stated}"


def test_the_films_without_a_flag_counted_are_those_of_the_sheet() -> None:
    films = sheet("validate-no-flag")["films"]
    answered = sum(not film["kinds"] for film in films)
    tested, found = rows()["films without a flag on a pole"]
    assert tested.startswith(f"[{len(films)} drawn films]")
    assert found == f"{len(films) - answered} refused, {answered} answered"


def test_the_overlapping_flags_counted_are_those_of_the_decision() -> None:
    page = (ROOT / "docs" / "decisions" / "081-a-second-pole-and-turned-films.md").read_text(
        encoding="utf-8"
    )
    (row,) = re.findall(r"^\| two flags \|.*\|$", page, flags=re.MULTILINE)
    refused, pairs = row.split("|")[4].split(" of ")
    said = " ".join(README.split())
    assert f"Of {pairs.strip()} pairs of overlapping flags {refused.strip()} were refused" in said


def test_the_forces_counted_are_those_of_the_sheet() -> None:
    score = (ROOT / "docs" / "results" / "challenge-registered" / "challenge-score.md").read_text(
        encoding="utf-8"
    )
    share = dict(re.findall(r"^\| ([^|]+) \| (\d+/\d+) \|", score, flags=re.MULTILINE))
    (nulls, of_nulls), (found, single), (named, _) = (
        share[name].split("/")
        for name in ("false positives on nulls", "detected: one effect", "top-1, all of one effect")
    )
    wrong, claims = share["false discoveries among claims"].split("/")
    assert rows()["named forces that did not act"] == ("the same sets", f"{wrong} of {claims}")
    tested, stated = rows()["forces missing from the cloth model"]
    (sets,) = re.findall(r"^(\d+) sets:", score, flags=re.MULTILINE)
    assert tested.startswith(f"[{sets} sealed sets]")
    assert stated == (
        f"{nulls} false alarm in {of_nulls}; of {single} hidden forces {found} detected, {named} "
        "named correctly"
    )


@pytest.mark.parametrize(
    ("row", "page", "tested"),
    [
        (
            "the same, from films",
            "docs/results/challenge-films-3/challenge-score",
            "three films of 25 s",
        ),
        (
            "the same, from films of three minutes",
            "docs/results/challenge-films-long/challenge-score",
            "three films",
        ),
    ],
)
def test_the_forces_counted_on_films_are_those_of_the_newest_sheets(
    row: str, page: str, tested: str
) -> None:
    score = json.loads((ROOT / f"{page}.json").read_text(encoding="utf-8"))
    verdicts = [(outcome["key"], outcome) for outcome in score["outcomes"]]
    stated_of, stated = rows()[row]
    assert stated_of == f"[{len(verdicts)} sealed sets]({page}.md) of {tested}"
    quiet = ("not decided", "no effect needed", "refused")
    nulls = [outcome["conclusion"] for key, outcome in verdicts if key["kind"] == "null"]
    single = [outcome["conclusion"] for key, outcome in verdicts if key["kind"] == "one"]
    alarms = sum(conclusion not in quiet for conclusion in nulls)
    detected = [conclusion for conclusion in single if conclusion not in quiet]
    named = re.search(
        r"^\| true effect among those named \| (\d+)/",
        (ROOT / f"{page}.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    assert named is not None
    assert detected.count("one of") == int(named[1])
    assert "refused" not in nulls  # a null that is refused counts as a false alarm
    assert stated == (
        f"{alarms or 'no'} false alarm{'s' if alarms > 1 else ''} in {len(nulls)}; "
        f"of {len(single)} hidden forces {len(detected)} detected, {named[1]} named among several"
    )


def test_what_it_takes_is_what_the_pages_and_the_program_state() -> None:
    install = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    (light,) = re.findall(
        r"^\| `pip install flagdata` .* \| ([\d.]+ GB) \|$", install, flags=re.MULTILINE
    )
    (full,) = re.findall(
        r"^\| `pip install 'flagdata\[physics\]'` .* \| ([\d.]+ GB) \|$",
        install,
        flags=re.MULTILINE,
    )
    said = " ".join(README.split())
    assert f"{full} of disk and no graphics card; {light} without the physics" in said
    start = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    assert f"in up to {MINUTES[Story.SHORT]} minutes on two idle cores" in start
    assert (
        f"takes up to {MINUTES[Story.FULL]} minutes on two idle cores, its short form up to "
        f"{MINUTES[Story.SHORT]}" in said
    )


def test_packages_and_disk_are_those_of_a_newcomers_run() -> None:
    kept = ROOT / "docs" / "results" / "bench-newcomer.json"
    if not kept.exists():
        pytest.skip("not measured yet: python -m tests.studies newcomer --out docs/results")
    install = (ROOT / "docs" / "install.md").read_text(encoding="utf-8")
    stated = re.findall(
        r"^\| `pip install .*? \| (\d+) \| ([\d.]+) GB \|$", install, flags=re.MULTILINE
    )
    result = sheet("bench-newcomer")["python3.11"]
    assert all(result[kind]["right"] for kind in ("light", "physics"))
    assert [(int(packages), float(disk)) for packages, disk in stated] == [
        (result[kind]["packages"], round(result[kind]["megabytes_on_disk"] / 1e3, 2))
        for kind in ("light", "physics")
    ]


def test_the_moving_picture_is_of_the_whole_example_and_light() -> None:
    path = ROOT / "docs" / "pictures" / "example.webp"
    assert README.index("docs/pictures/example.webp") < README.index("## ")
    assert path.stat().st_size < MOST_BYTES
    with Image.open(path) as picture:
        lasting = 0
        for frame in ImageSequence.Iterator(picture):
            frame.load()
            lasting += frame.info["duration"]
    assert lasting == pytest.approx(12_000, rel=0.02)  # ms of the film


def test_the_citation_is_of_this_version() -> None:
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\ntitle: {stated['name']}\n" in citation
    assert f"\nversion: {stated['version']}\n" in citation
    assert f"\nlicense: {stated['license']}\n" in citation


def test_pictures_and_pages_that_the_readme_links_to_exist() -> None:
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
