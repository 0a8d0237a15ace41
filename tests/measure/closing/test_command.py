"""`flagdata close-loop`: what does not fit is refused before anything is simulated, with the option
it is about."""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.core.findings import Finding, Severity
from flagdata.core.stated import Stated
from flagdata.errors import NotFoundError, UsageError
from flagdata.ingest import MarkerOptions, ingest_markers
from flagdata.lake import Lake
from measure.closing import SourceOptions
from measure.closing.verdict_sources import read
from measure.commands import CloseLoopCommand
from measure.commands.close_loop import _setup as setup_of
from measure.commands.close_loop import with_warnings
from measure.trajectories import Setup, Up, parse
from measure.verdict import Conclusion
from tests.measure.report.verdicts import Size, verdict
from tests.measure.trajectories.flags import HEIGHT, RATE, WIDTH, write_tracks
from tests.program import invoke


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of 40 frames in one table, z up, in metres."""
    return write_tracks(tmp_path_factory.mktemp("tracks") / "tracks.csv", "calm", "brisk")


def said(arguments: Sequence[str]) -> tuple[int, dict]:
    """Exit code and document of a command that fails."""
    ended = invoke("close-loop", *arguments, "--json")
    return ended.code, ended.document


@pytest.mark.parametrize(
    ("arguments", "code", "what"),
    [
        ([], 2, "no recordings"),
        (["nowhere.csv"], 1, "does not exist"),
        (["nowhere.csv", "nowhere.toml"], 1, "no such recipe"),
        (["nowhere.csv", "--nulls", "100"], 2, "100 nulls"),
        (["nowhere.csv", "--nulls", "200", "--bank", "."], 2, "both --nulls and --bank"),
        (["nowhere.csv", "--level", "1.5"], 2, "1.5"),
        (["nowhere.csv", "--material", "camel-ponte-rom"], 2, "camel-ponte-rom"),
        (["nowhere.csv", "--density-uncertainty", "0"], 2, "density-uncertainty"),
        (["nowhere.csv", "--density-uncertainty", "2"], 2, "density-uncertainty"),
        (["nowhere.csv", "--flag-size", "1.5"], 2, "not a flag's size"),
        (["nowhere.csv", "--suspect", "lifft"], 2, "lifft"),
        (["nowhere.csv", "--suspect", "vertical-wind"], 2, "above or below 0"),
        (["nowhere.csv", "--suspect", "hem-mass-"], 2, "less than none"),
        (["nowhere.csv", "--attachment", "hoist-corner"], 2, "no place"),
        (["nowhere.csv", "--up", "w"], 2, "unknown axis"),
        (["nowhere.csv", "--axis", "1,0"], 2, "three numbers"),
        (["nowhere.csv", "--axis", "0,0,0"], 2, "no direction"),
        (["nowhere.csv", "--axis", "1,0,0", "--north", "30"], 2, "both --axis and --north"),
        (["nowhere.csv", "--lake", "nowhere"], 1, "no lake"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments: Sequence[str], code: int, what: str) -> None:
    ended, error = said(arguments)
    assert ended == code
    assert what in error["what"]
    assert error["fix"]


def test_winds_are_one_for_all_or_one_each(table: Path) -> None:
    code, error = said([str(table), "--rate", str(RATE), *["--wind", "4"] * 3])
    assert (code, error["what"]) == (2, "there are 3 winds for 2 recordings")


@pytest.mark.parametrize("option", ["--clock-offset=2", "--sensor=generic-csv", "--zone=+02:00"])
def test_options_of_a_log_are_not_ignored_where_there_is_none(table: Path, option: str) -> None:
    code, error = said([str(table), "--rate", str(RATE), "--wind", "4", option])
    assert (code, error["where"]) == (2, option.partition("=")[0])


def test_a_log_is_read_as_its_sensor_and_zone_say(table: Path, tmp_path: Path) -> None:
    """Its first frame at the log's second sample, whose speed is 5."""
    log = tmp_path / "log.csv"
    log.write_text(
        "time,wind_speed\n2026-05-14 09:30:00,4\n2026-05-14 09:30:01,5\n2026-05-14 09:30:02,6\n"
    )
    reading = SourceOptions(rate=RATE, offset=1.0, sensor="generic-csv", zone="+02:00")
    calm, _ = read([str(table)], [str(log)], reading, None)
    assert calm.wind is not None
    np.testing.assert_allclose(calm.wind.at(np.array([0.0, 0.5])), [[5, 0, 0], [5.5, 0, 0]])


def test_a_warning_that_may_explain_the_verdict_is_reported_with_it() -> None:
    whole = verdict(Conclusion.EFFECT, Size(across=3, up=3, frames=20, stretch=2))
    doubt = Finding(
        kind="inertia-does-not-fit",
        severity=Severity.WARNING,
        what="it moves as in 8 m/s",
        where="flag",
    )
    other = replace(doubt, kind="cloth-not-covered", what="no marker near", severity=Severity.NOTE)
    changed = with_warnings(whole, (doubt, other))
    remark = (
        "The data themselves may be wrong, which would look like an effect: flag: it moves as in 8 "
        "m/s."
    )
    assert changed.words == f"{whole.words} {remark}"
    assert changed.findings == (
        ("inertia-does-not-fit", "flag: it moves as in 8 m/s"),
        ("cloth-not-covered", "flag: no marker near"),
    )
    assert with_warnings(whole, (other,)).words == whole.words


@pytest.mark.parametrize(
    "option",
    [
        "--wind=4",
        "--axis=1,0,0",
        "--rate=25",
        "--unit=mm",
        "--up=y",
        "--noise=0.001",
        "--sensor=generic-csv",
        "--zone=UTC",
    ],
)
def test_beside_a_recipe_with_recordings_no_option_is_ignored(
    table: Path, tmp_path: Path, option: str
) -> None:
    recipe = tmp_path / "flag.toml"
    recipe.write_text(f'[[recording]]\nsource = "{table}"\ntake = "calm"\n')
    code, error = said([str(recipe), option])
    assert (code, error["where"]) == (2, option.partition("=")[0])
    code, error = said([str(table), str(recipe)])
    assert (code, error["where"]) == (2, "SOURCE")


def test_a_draft_is_the_recipe_of_what_the_command_line_states(table: Path, tmp_path: Path) -> None:
    path = tmp_path / "deeper" / "flag.toml"
    path.parent.mkdir()
    words = (
        "--wind 4 --wind 8 --axis 0,2,0 --attachment 0,0;0,0.4 --flag-size 1.2x0.8 --material paper"
    )
    words += " --density-uncertainty 0.02"
    given = (
        "close-loop",
        table,
        *words.split(),
        "--noise",
        "0.001",
        "--rate",
        RATE,
        "--draft",
        path,
        "--json",
    )
    ended = invoke(*given)
    assert (ended.code, ended.document["recipe"]) == (0, str(path))
    recipe = parse(path)
    assert [(one.take, one.noise) for one in recipe.recordings] == [("calm", 1e-3), ("brisk", 1e-3)]
    assert [one.wind.velocity for one in recipe.recordings if one.wind] == [
        (0.0, 4.0, 0.0),
        (0.0, 8.0, 0.0),
    ]
    chosen = CloseLoopCommand(
        sources=(str(table),),
        attachment="0,0;0,0.4",
        flag_size="1.2x0.8",
        material="paper",
        density_uncertainty=0.02,
    )
    setup = setup_of(Setup(), chosen)
    assert recipe.setup.pins == setup.pins
    assert recipe.setup.material is not None
    assert recipe.setup.material.name == "paper"
    assert recipe.setup.relative == pytest.approx(0.02)
    np.testing.assert_allclose(recipe.setup.outline, setup.outline)  # type: ignore[arg-type]
    assert invoke(*given).code == 1  # the file is there
    again = invoke("close-loop", path, "--draft", tmp_path / "other.toml", "--json")
    assert (again.code, again.document["where"]) == (2, "--draft")


@pytest.mark.parametrize(
    ("line", "what"), [("nuls = 64", "did you mean 'nulls'"), ("nulls = 0.5", "whole number")]
)
def test_a_recipe_says_what_the_test_is_and_no_more(tmp_path: Path, line: str, what: str) -> None:
    recipe = tmp_path / "flag.toml"
    recipe.write_text(f"[test]\n{line}\n")
    code, error = said(["tracks.csv", str(recipe)])
    assert code in (1, 2)
    assert what in error["fix"]


def test_data_that_are_no_cloth_end_it_with_the_reason(table: Path) -> None:
    """Markers in millimetres that are taken for metres."""
    code, error = said(
        [
            str(table),
            "--rate",
            str(RATE),
            "--wind",
            "4",
            "--flag-size",
            f"{1e3 * WIDTH}x{1e3 * HEIGHT}",
            "--attachment",
            "hoist",
            "--material",
            "camel-ponte-roma",
        ],
    )
    assert (code, error["kind"]) == (1, "bad-input")


def test_each_recording_of_a_table_has_its_wind(table: Path) -> None:
    reading = SourceOptions(rate=RATE, noise=1e-3, axis=(0.0, 2.0, 0.0))
    calm, brisk = read([str(table)], ["3", "7"], reading, None)
    assert (calm.name, brisk.name) == ("calm", "brisk")
    assert calm.noise == 1e-3
    assert calm.wind is not None
    assert brisk.wind is not None
    np.testing.assert_allclose(calm.wind.velocity, [[0, 3, 0]])
    np.testing.assert_allclose(brisk.wind.velocity, [[0, 7, 0]])


def test_markers_of_a_lake_and_of_a_file_are_the_same(table: Path, tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    kept = ingest_markers(lake, table, MarkerOptions(rate=RATE))
    from_file = read([str(table)], ["4"], SourceOptions(rate=RATE, up=Up.Y), lake)
    from_lake = read([result.artifact.id for result in kept], ["4"], SourceOptions(up=Up.Y), lake)
    for one, other, result in zip(from_file, from_lake, kept, strict=True):
        np.testing.assert_array_equal(one.positions, other.positions)
        assert one.wind is not None
        np.testing.assert_array_equal(
            one.wind.velocity, [[4, 0, 0]]
        )  # given with z up, whatever the recording's axes
        assert (one.source, other.source) == ("", result.artifact.id)


def test_a_speed_needs_an_axis_and_a_source_a_place(table: Path) -> None:
    north = SourceOptions(rate=RATE, axis=None, north=math.radians(30))
    with pytest.raises(UsageError, match="direction"):
        read([str(table)], ["4"], north, None)
    with pytest.raises(NotFoundError, match="nowhere"):
        read(["nowhere"], [], SourceOptions(), None)


def test_recordings_of_one_name_get_names_that_differ(table: Path) -> None:
    names = [
        seen.name for seen in read([str(table), str(table)], ["4"], SourceOptions(rate=RATE), None)
    ]
    assert len(set(names)) == 4


def test_the_uncertainty_of_the_weight_on_the_command_line_is_that_of_the_setup() -> None:
    unweighed = Setup(area_weight_uncertainty=None)
    setup = setup_of(unweighed, CloseLoopCommand(density_uncertainty=0.02))
    assert setup.relative == 0.02
    weighed = replace(unweighed, area_weight=Stated.of("0.155±0.003"))
    setup = setup_of(weighed, CloseLoopCommand(density_uncertainty=0.02))
    assert (setup.area_weight, setup.relative) == (Stated.of(0.155), 0.02)
    assert setup_of(unweighed, CloseLoopCommand()) == unweighed


def test_a_weighed_cloth_has_the_weight_that_the_command_line_states() -> None:
    """N(0.155, 0.003²) is 1.94 % of its value; a range is uniform, of standard deviation width /
    √12."""
    given = CloseLoopCommand(material="paper", area_weight=Stated.of("0.155±0.003"))
    setup = setup_of(Setup(area_weight_uncertainty=None), given)
    assert setup.area_weight == given.area_weight
    assert setup.relative == pytest.approx(0.003 / 0.155)
    between = setup_of(
        Setup(), CloseLoopCommand(material="paper", area_weight=Stated.of("0.15:0.16"))
    )
    assert between.relative == pytest.approx(0.01 / math.sqrt(12) / 0.155)


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"area_weight": Stated.of("0.155"), "material": "paper"}, "has no usable uncertainty"),
        ({"area_weight": Stated.of("0.155±0.003"), "density_uncertainty": 0.02}, "is given twice"),
    ],
)
def test_a_weight_that_cannot_be_used_is_refused(given: dict[str, Any], what: str) -> None:
    with pytest.raises(UsageError, match=what):
        setup_of(Setup(), CloseLoopCommand(**given))


def test_recordings_of_a_bucket_are_those_of_their_table(
    table: Path, bucket_folder: str, tmp_path: Path
) -> None:
    lake = Lake.create(bucket_folder)
    taken = ingest_markers(lake, table, MarkerOptions(rate=RATE))
    shutil.rmtree(tmp_path / "cache")
    found = read(
        [result.artifact.id for result in taken], ["4"], SourceOptions(), Lake.open(bucket_folder)
    )
    expected = read([str(table)], ["4"], SourceOptions(rate=RATE), None)
    assert [one.source for one in found] == [result.artifact.id for result in taken]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.positions, other.positions)
