"""A recipe's wind from samples or a log: what blows is what was given, and what does not cover the
run is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import flagdata
from flagdata.core.schema import Kind
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.lake import Artifact, Lake, MeshSequence, read_meshes
from flagdata.record import RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from sim.run import Recipe, of_content
from tests.program import Ended, Run, invoke
from tests.refusals import unrefused

TIME = {"settle": 0.2, "frames": 6, "rate": 25.0}
SMALL = {"scene": {"columns": 4}, "time": TIME}
GUST = np.array(
    [[-0.3, 2.0, 0.0, 0.0], [0.0, 4.0, 1.0, 0.0], [0.1, 8.0, 0.0, 0.5], [0.5, 4.0, 0.0, 0.0]]
)
FRAMES = np.arange(6) / 25


def at(rows: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(n, 3) linear between rows of time and velocity."""
    return np.stack([np.interp(times, rows[:, 0], rows[:, axis]) for axis in (1, 2, 3)], axis=1)


def test_an_array_blows_as_it_is_in_every_member_and_is_read_back() -> None:
    flags = flagdata.simulate(**SMALL, wind={"samples": GUST}, count=2, batch=2)
    assert flags.wind.shape == (2, 6, 3)
    np.testing.assert_allclose(flags.wind[1], at(GUST, FRAMES), rtol=1e-6)
    np.testing.assert_allclose(flags[0].attributes["wind"], flags.wind[0], rtol=0, atol=0)
    mean = at(GUST, FRAMES).mean(axis=0)
    assert flags.parameters["wind_speed"][0] == pytest.approx(np.hypot(mean[0], mean[1]))
    assert flags.parameters["wind_toward"][0] == pytest.approx(np.arctan2(mean[1], mean[0]))
    assert flags.parameters["wind_vertical"][0] == pytest.approx(mean[2])


def test_samples_that_do_not_vary_move_the_cloth_as_the_steady_wind_does() -> None:
    still = [[-1.0, 3.0, 0.0, 0.0], [0.1, 3.0, 0.0, 0.0], [1.0, 3.0, 0.0, 0.0]]
    steady, sampled = (
        flagdata.simulate(**SMALL, wind=wind, seed=4)
        for wind in ({"speed": 3.0}, {"samples": still})
    )
    np.testing.assert_array_equal(sampled.positions, steady.positions)
    np.testing.assert_array_equal(sampled.wind, steady.wind)
    assert "wind" not in steady[0].attributes


def test_a_gust_that_is_drawn_is_read_back_as_well() -> None:
    flags = flagdata.simulate(
        **SMALL, wind={"speed": 5.0}, effects={"gusts": {"intensity": 0.3}}, count=2, seed=1
    )
    assert np.ptp(flags.wind[:, :, 0], axis=1).min() > 0
    assert not np.array_equal(flags.wind[0], flags.wind[1])


def log(start: int = 1_777_000_000_000_000_000) -> WindSeries:
    """20 s at 2 Hz whose direction turns; the vector mean goes anywhere."""
    since = np.arange(40) / 2
    return WindSeries(
        time=start + (since * 1e9).astype(np.int64),
        channels={"wind_speed": 5 + np.sin(since), "wind_direction": 2.0 + 0.3 * np.cos(since)},
        flags=np.zeros(40, dtype=np.uint16),
        sensor=Sensor(name="cup"),
    )


def expected(first: float, toward: float) -> np.ndarray:
    """(6, 3) of that log at the frames of a run that begins `first` seconds into it."""
    since, series = np.arange(40) / 2, log()
    # Blowing from θ clockwise from north: towards π/2 − θ + π counter-clockwise from east.
    angle = 1.5 * np.pi - series.channels["wind_direction"]
    air = series.channels["wind_speed"] * np.exp(1j * angle)
    air = air * np.exp(1j * (toward - np.angle(air.mean())))
    rows = np.stack([since, air.real, air.imag, 0 * since], axis=1)
    return at(rows, first + FRAMES)


def test_a_log_from_python_blows_about_its_mean_from_the_instant_that_is_named() -> None:
    series = log()
    wind = flagdata.answer.film_series.Wind(
        name="cup",
        time=np.arange(40) / 2,
        start=int(series.time[0]),
        speed=series.channels["wind_speed"],
        direction=series.channels["wind_direction"],
        channels=series.channels,
        flags=series.flags,
        sensor=series.sensor,
    )
    flags = flagdata.simulate(**SMALL, wind={"log": wind, "log-start": 3.2, "toward": 0.4})
    np.testing.assert_allclose(flags.wind[0], expected(3.2, 0.4), rtol=1e-5, atol=1e-6)


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    """A lake with that log."""
    made = Lake.create(tmp_path / "lake")
    with made.transaction("a log") as transaction:
        staged = transaction.staging(".mcap")
        with RecordWriter(staged, metadata={}) as writer:
            writer.wind(log())
        transaction.add(
            Artifact(
                kind=Kind.WIND, name="mast", object=transaction.put(staged), recipe={"of": "log"}
            )
        )
    return made


RECIPE = """
[scene]
columns = 4
[material]
name = "camel-ponte-roma"
[wind]
{wind}
[time]
settle = 0.2
frames = 6
"""


@pytest.fixture
def run(lake: Lake, tmp_path: Path) -> Run:
    """Simulate a recipe with such a wind."""

    def simulate(wind: str) -> Ended:
        recipe = tmp_path / "gusty.toml"
        recipe.write_text(RECIPE.format(wind=wind))
        return invoke("simulate", recipe, "--lake", lake.path, "--json")

    return simulate


def test_a_log_of_the_lake_blows_and_is_the_parent_of_what_it_moved(run: Run, lake: Lake) -> None:
    ended = run('log = "mast"\nlog-start = 3.2\ntoward-deg = 20.0')
    (made,) = ended.document["added"]
    artifact = Lake.open(lake.path).artifact(made)
    assert [Lake.open(lake.path).artifact(parent).name for parent in artifact.parents] == ["mast"]
    sequence = read_meshes(lake.object_path(artifact.object or ""))
    assert isinstance(sequence, MeshSequence)
    blown = expected(3.2, np.radians(20.0))
    np.testing.assert_allclose(sequence.attributes["wind"], blown, rtol=1e-5, atol=1e-6)
    assert artifact.wind == pytest.approx(np.hypot(*blown.mean(axis=0)[:2]), rel=1e-5)
    assert run('log = "mast"\nlog-start = 3.2\ntoward-deg = 20.0').document["added"] == []
    assert len(run('log = "mast"\nlog-start = 3.3\ntoward-deg = 20.0').document["added"]) == 1


def test_an_array_in_a_recipe_blows_as_from_python(run: Run, lake: Lake) -> None:
    (made,) = run(f"samples = {GUST.tolist()}").document["added"]
    sequence = read_meshes(lake.object_path(Lake.open(lake.path).artifact(made).object or ""))
    flags = flagdata.simulate(**SMALL, wind={"samples": GUST})
    np.testing.assert_array_equal(sequence.positions, flags.positions[0])


def test_a_log_that_the_lake_does_not_have_is_an_error(run: Run) -> None:
    ended = run('log = "mats"')
    assert (ended.code, "did you mean 'mast'" in ended.out + ended.err) == (2, True)


def recipe_of(wind: dict[str, object]) -> Recipe:
    content = {**SMALL, "material": {"name": "camel-ponte-roma"}, "wind": wind}
    return of_content(content, name="r", folder=Path(), where="r")


def test_what_makes_no_wind_is_refused_and_says_why() -> None:
    cases = [
        ({"speed": 3.0, "samples": GUST}, UsageError, "speed and samples are given; keep one"),
        ({"log": "mast", "samples": GUST}, UsageError, "log and samples"),
        (
            {"log": "mast"},
            UsageError,
            "'mast' is looked for in a lake.*as flagdata.wind returns it",
        ),
        (
            {"samples": GUST[1:]},
            InputError,
            r'from 0 to 0\.5 s and the run lasts from -0\.2 .*beyond = "hold"',
        ),
        ({"samples": GUST[:3]}, InputError, "give a longer series"),
        ({"samples": GUST[::-1]}, InputError, "sort the rows by time"),
        ({"samples": GUST[:, :3]}, InputError, r"\[\[time, x, y, z\], …\]"),
        ({"samples": "gusty"}, InputError, "no table of numbers"),
        ({"samples": GUST, "toward": 0.1}, UnknownNameError, "toward"),
        ({"samples": GUST, "beyond": "hodl"}, UnknownNameError, "did you mean 'hold'"),
    ]
    assert not unrefused(recipe_of, cases)


def test_a_run_that_goes_beyond_its_samples_may_hold_the_last_one() -> None:
    flags = flagdata.simulate(**SMALL, wind={"samples": GUST[1:3], "beyond": "hold"})
    np.testing.assert_allclose(flags.wind[0], at(GUST[1:3], FRAMES), rtol=1e-6)
    np.testing.assert_allclose(flags.wind[0, -1], GUST[2, 1:], rtol=1e-6)


def test_only_the_samples_of_the_run_make_a_recipe_what_it_is() -> None:
    longer = np.concatenate([[[-9.0, 1.0, 0.0, 0.0]], GUST, [[9.0, 1.0, 0.0, 0.0]]])
    other = GUST + np.array([0.0, 1e-3, 0.0, 0.0])
    hashes = [json.dumps(recipe_of({"samples": rows}).identity()) for rows in (GUST, longer, other)]
    assert hashes[0] == hashes[1] != hashes[2]
    assert "samples" not in recipe_of({"speed": 3.0}).identity()["wind"]
