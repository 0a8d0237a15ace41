"""`flagdata close-loop` on tables of observables: dispatch, refusals, what is written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from flagdata.answer import Quantity
from flagdata.core.schema import Kind
from flagdata.errors import UsageError
from flagdata.lake import Artifact, Lake
from measure.cloth import OBSERVED, films_among, simulations_of
from measure.commands.close_loop import close_loop
from measure.forecasting import strengths
from measure.forecasting.regressors import weighed_columns
from measure.loop import LoopOptions
from measure.observables import WINDOW
from measure.trajectories import Experiment
from measure.verdict import CRITERIA, Conclusion, Parameter, Verdict
from sim.effects import Need
from sim.run import load
from tests.golden_answers import changes
from tests.measure.cloth.loop.conftest import EFFECTS, recording
from tests.measure.report.verdicts import verdict
from tests.measure.trajectories.flags import HEIGHT, RATE, WIDTH, write_tracks


def table(path: Path, *, mean: float, effects: Mapping[str, float] | None = None) -> Path:
    """A table as `flagdata observe` writes it."""
    one = recording(mean=mean, seed=5, effects=effects)
    rows = [
        ",".join(str(v) for v in (WINDOW * (number + 0.5), speed, *own))
        for number, (speed, own) in enumerate(
            zip(one.speed.tolist(), one.readings.tolist(), strict=True)
        )
    ]
    path.write_text("\n".join([f"time,wind,{','.join(OBSERVED)}", *rows]) + "\n")
    return path


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(close_loop, [str(one) for one in arguments])


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three effects are weighed."""
    kept = [column for column in weighed_columns(Need.FILMS) if column.name in EFFECTS]
    monkeypatch.setattr(strengths, "weighed_columns", lambda kind: kept)


def test_tables_are_judged_written_and_kept(tmp_path: Path, cheap: list[int], few: None) -> None:
    lake, out = tmp_path / "lake", tmp_path / "out"
    Lake.create(lake)
    effects = {"tangential-linear-drag.coefficient": 0.9}
    tables = [
        table(tmp_path / f"{name}.csv", mean=mean, effects=effects)
        for name, mean in (("calm", 4.0), ("brisk", 6.5))
    ]
    given = (
        *tables,
        "--flag-size",
        "1.5x1.0",
        "--azimuth",
        "70±7",
        "--simulations",
        "64",
        "--lake",
        lake,
    )
    done = run(*given, "--out", out, "--json")
    assert done.exit_code == 0, done.output
    verdict = json.loads(done.stdout)
    assert verdict["schema"] == "flagdata.verdict/1"
    assert changes("verdict-of-films", verdict, relative=1e-5) == []
    assert verdict["named"] == ["tangential-linear-drag"]
    assert 0 < verdict["seconds"] < 300
    assert {one["effect"] for one in verdict["power"]} == {
        "lift",
        "shear",
        "tangential-linear-drag",
    }
    assert verdict["test"]["effective"] <= len(verdict["test"]["null"])
    assert verdict["provenance"]["criteria"]["hash"] == CRITERIA.hash
    assert {path.name for path in out.iterdir()} == {
        "report.html",
        "verdict.json",
        "base.toml",
        "model.toml",
    }
    text = (out / "report.html").read_text()
    assert "Adding tangential-linear-drag (coefficient " in text
    assert "droop, recordings left out" in text
    model = load(str(out / "model.toml"))
    assert list(model.effects) == ["tangential-linear-drag"]
    assert not load(str(out / "base.toml")).effects
    opened = Lake.open(lake)
    assert opened.artifact(verdict["artifacts"]["measurement"]).name == "calm"
    assert len(opened.rows({"kind": "model"})) == 2
    again = json.loads(run(*given, "--out", tmp_path / "other", "--json").stdout)
    assert again["artifacts"]["existing"]
    assert again["artifacts"]["measurement"] == verdict["artifacts"]["measurement"]
    suspected = json.loads(
        run(*given, "--suspect", "lift", "--out", tmp_path / "suspected", "--json").stdout
    )
    assert suspected["test"]["suspected"] == "lift+"
    assert not suspected["artifacts"]["existing"]
    words = run(*given, "--out", tmp_path / "third").stdout
    assert "Adding tangential-linear-drag (coefficient " in " ".join(words.split())
    assert max(map(len, words.splitlines())) <= 100


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "the flag's size is missing"),
        (("--flag-size", "1.5x1.0", "--wind", "5"), "films and tables of observables"),
        (("--flag-size", "1.5x1.0", "--pins", "top-corners"), "top-corners"),
        (("--flag-size", "1.5x1.0", "--azimuth", "190"), "give degrees from 1 to 179"),
        (
            ("--flag-size", "1.5x1.0", "--area-weight", "0"),
            "null experiments have flags of 0.05 to 0.45",
        ),
        (("--flag-size", "1.5x1.0", "--crop", "0,0,9,9"), "a table of observables has no pictures"),
        (("--flag-size", "1.5x1.0", "--nulls", "2"), "kinds"),
        (("--flag-size", "1.5x1.0", "--material", "bunting"), "woven-polyester, woven-cotton"),
        (("--flag-size", "1.5x1.0", "--suspect", "lifft"), "did you mean 'lift'"),
        (
            ("--flag-size", "1.5x1.0", "--suspect", "vertical-wind"),
            "vertical-wind+ or vertical-wind-",
        ),
        (("--flag-size", "1.5x1.0", "--start", "40s"), "s of film have a log beside them"),
    ],
)
def test_what_makes_no_sense_is_refused_and_nothing_is_written(
    tmp_path: Path, cheap: list[int], arguments: tuple[str, ...], said: str
) -> None:
    done = run(table(tmp_path / "t.csv", mean=5.0), *arguments, "--out", tmp_path / "out")
    assert done.exit_code != 0
    error = done.exception
    assert (
        said in f"{error} {getattr(error, 'where', '')} {getattr(error, 'fix', '')} {done.output}"
    )
    assert not (tmp_path / "out").exists()


def test_one_recording_that_cannot_be_used_is_left_out_and_the_stated_fabric_is_simulated(
    tmp_path: Path, cheap: list[int], few: None
) -> None:
    """One of three is too short: the verdict is that of the two others, and the page names it."""
    good = [table(tmp_path / f"{mean}.csv", mean=mean) for mean in (4.0, 6.5)]
    short = table(tmp_path / "short.csv", mean=5.0)
    short.write_text("\n".join(short.read_text().splitlines()[:4]) + "\n")
    out = tmp_path / "out"
    given = (
        "--flag-size",
        "1.5x1.0",
        "--azimuth",
        "70±7",
        "--material",
        "woven-cotton",
        "--out",
        out,
        "--json",
    )
    done = run(*good, short, *given)
    assert done.exit_code == 0, done.output
    verdict = json.loads(done.stdout)
    (left,) = [one for one in verdict["findings"] if one[0] == "left-out"]
    assert left[1].startswith(f"{short} is left out: ")
    assert "short.csv is left out" in (out / "report.html").read_text()
    options = verdict["provenance"]["options"]
    assert (options["material"], options["simulations"]) == ("woven-cotton", 128)
    assert [simulations_of(count) for count in (1, 2, 3, 9)] == [64, 64, 128, 128]
    assert 'name = "11oz-black-denim"' in (out / "base.toml").read_text()


def test_options_of_films_are_refused_beside_markers(tmp_path: Path) -> None:
    path = tmp_path / "tracks.csv"
    path.write_text("frame,marker,u,v,x,y,z\n0,a,0,0,0,0,0\n")
    done = run(path, "--wind", "5", "--azimuth", "70±7", "--out", tmp_path / "out")
    assert isinstance(done.exception, UsageError)
    assert done.exception.where == "--azimuth"


def test_films_and_markers_of_a_cloth_are_judged_together(
    tmp_path: Path, cheap: list[int], few: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each at half of the level; one answer, and each kind's own beside it."""
    levels: list[float] = []

    def closed(experiment: Experiment, options: LoopOptions, *, stage: object) -> Verdict:
        levels.append(options.level)
        one = Quantity.of(value=1.0, low=0.8, high=1.2, unit="of nominal")
        fitted = [
            Parameter(name=name, before=one, after=one, shift=0.0)
            for name in ("area_weight", "bending", "damping")
        ]
        return replace(verdict(Conclusion.EFFECT), parameters=tuple(fitted))

    monkeypatch.setattr("measure.closing.close.close_loop", closed)
    effects = {"lift.coefficient": 6.0}
    tables = [table(tmp_path / f"{mean}.csv", mean=mean, effects=effects) for mean in (4.0, 6.5)]
    tracks = write_tracks(tmp_path / "tracks.csv", "calm", frames=110)
    lake, out = tmp_path / "lake", tmp_path / "out"
    Lake.create(lake)
    cloth = tmp_path / "cloth.toml"
    cloth.write_text(f'[cloth]\nwidth = {WIDTH}\nheight = {HEIGHT}\n[attachment]\nat = "hoist"\n')
    done = run(
        *tables,
        tracks,
        "--rate",
        str(RATE),
        "--wind",
        "5",
        cloth,
        "--material",
        "white-dots-on-blk",
        "--flag-size",
        "1.5x1.0",
        "--azimuth",
        "70±7",
        "--simulations",
        "64",
        "--lake",
        lake,
        "--out",
        out,
        "--json",
    )
    assert done.exit_code == 0, done.output
    joint = json.loads(done.stdout)
    assert joint["schema"] == "flagdata.joint-verdict/1"
    assert levels == [0.025]
    assert joint["films"]["test"]["level"] == 0.025
    assert joint["named"] == ["lift"]
    smaller = min(joint[kind]["test"]["p_value"]["value"] for kind in ("markers", "films"))
    assert joint["p_value"] == pytest.approx(2 * smaller)
    assert {path.name for path in out.iterdir()} == {
        "report.html",
        "verdict.json",
        "markers",
        "films",
    }
    for kind in ("markers", "films"):
        assert (out / kind / "report.html").exists()
        assert f'id="{kind}-test"' in (out / "report.html").read_text()
    kept = Lake.open(lake).rows({"kind": "measurement"}).num_rows
    assert kept == 2


def test_a_number_of_nulls_is_refused_beside_both_kinds(tmp_path: Path) -> None:
    tracks = write_tracks(tmp_path / "tracks.csv", "calm")
    done = run(
        tracks, table(tmp_path / "t.csv", mean=5.0), "--nulls", "200", "--out", tmp_path / "out"
    )
    assert isinstance(done.exception, UsageError)
    assert done.exception.where == "--nulls"


def test_a_video_counts_as_a_film_and_a_recipe_does_not(tmp_path: Path) -> None:
    for name in ("flag.mp4", "flag.toml"):
        (tmp_path / name).write_bytes(b"no film")
    both = [str(tmp_path / name) for name in ("flag.mp4", "flag.toml")]
    assert films_among(both, lake=None, at="main") == (both[0],)


def test_recordings_of_a_lake_are_films_and_its_markers_are_not(tmp_path: Path) -> None:
    """Also a recording that was measured, and whose measurement has its name."""
    lake = Lake.create(tmp_path / "lake")
    calm, tracked = (
        Artifact(kind=kind, name=name, parents=(), recipe={"name": name}, seed=0)
        for name, kind in (("calm", Kind.RECORDING), ("tracked", Kind.MARKERS))
    )
    measured = Artifact(
        kind=Kind.MEASUREMENT, name="calm", parents=(calm.id,), recipe={"wind": 5}, seed=0
    )
    with lake.transaction("three") as transaction:
        for artifact in (calm, tracked, measured):
            transaction.add(artifact)
    assert films_among(["calm", "tracked"], lake=lake, at="main") == ("calm",)
    assert films_among(["tracked"], lake=lake, at="main", sized=True) == ()
    assert films_among(["absent"], lake=lake, at="main", sized=True) == ("absent",)


def test_a_recording_that_is_not_there_is_named(tmp_path: Path) -> None:
    lake = tmp_path / "lake"
    Lake.create(lake)
    done = run("calm", "--lake", lake, "--flag-size", "1.5x1.0", "--out", tmp_path / "out")
    assert "unknown file or film of the lake 'calm'" in f"{done.exception}"


def test_rows_against_wind_are_recordings_from_one_place(
    tmp_path: Path, cheap: list[int], few: None
) -> None:
    path = tmp_path / "paper.csv"
    path.write_text(
        "wind,duration,droop,extension\n4,60,0.38,0.9\n5,60,0.24,0.9\n6.5,60,0.09,0.9\n"
    )
    done = run(
        path, "--flag-size", "1.5x1.0", "--simulations", "64", "--out", tmp_path / "out", "--json"
    )
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert {one["what"] for one in found["comparisons"]} == {
        "droop, recordings left out",
        "extension, recordings left out",
    }
