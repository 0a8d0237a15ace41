"""Numbers that are impossible or doubtful open a question; the answer closes it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.units import unit
from flagdata.errors import UnknownNameError
from flagdata.ingest import OpenFactsError, Reading, WindOptions, read_log
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.ingest.anemometer.draft.doubts import KEYS, doubts
from flagdata.record.signals import Sensor

Write = Callable[[str | bytes], Path]
PLAIN = "time,wind_speed (m/s),wind_direction (deg)\n"


def table(
    speed: Callable[[int], object],
    away: Callable[[int], object],
    stamp: str = "2026-05-01T12:{m:02d}:{s:02d}Z",
) -> str:
    return PLAIN + "".join(
        f"{stamp.format(m=k // 60, s=k % 60, h=k // 2)},{speed(k)},{away(k)}\n" for k in range(60)
    )


def usual(k: int) -> float:
    return 4 + k % 7 / 10


def vane(k: int) -> float:
    return 200 + k % 9


def blowing(k: int, away: float) -> str:
    """A row with a direction, and components towards east and north of a wind that comes from
    `away` [deg]."""
    east, north = -usual(k) * np.sin(np.radians(away)), -usual(k) * np.cos(np.radians(away))
    return f"2026-05-01T12:00:{k:02d}Z,{usual(k)},{vane(k)},{east:.3f},{north:.3f}\n"


HEADING = "time,wind_speed (m/s),wind_direction (deg),eastward wind (m/s),northward wind (m/s)\n"
COMPONENTS = HEADING + "".join(blowing(k, vane(k) + 180) for k in range(60))
ODD = {
    "fast": table(lambda k: 80.5 if k == 9 else usual(k), vane),
    "strong": table(lambda k: 31 + k % 7 / 10, vane),
    "negative": table(lambda k: -0.1 - k / 1000 if k % 10 == 3 else usual(k), vane),
    "still": table(lambda k: 0, vane),
    "constant": table(lambda k: 4.1, vane),
    "angles": table(lambda k: 6 * k % 360, vane).replace("(m/s)", "(km/h)", 1),
    "out-of-range": table(usual, lambda k: 400 if k == 5 else vane(k)),
    "code": table(lambda k: 99.9 if k % 20 == 3 else usual(k), vane).replace("(m/s)", "(km/h)", 1),
    "steps": table(lambda k: round(1.609344 * (k * 7 % 31), 1), vane),
    "grows": table(lambda k: round(0.4 * (k % 40), 1), vane),
    "gust": table(usual, vane).replace("wind_direction (deg)", "wind gust (m/s)"),
    "components": COMPONENTS,
    "tens": table(usual, lambda k: 19 + k % 4).replace(" (deg)", ""),
    "fixed": table(usual, lambda k: 123),
    "calm": table(lambda k: 0.1 if k < 5 else usual(k), lambda k: 0 if k < 5 else vane(k)),
    "order": table(usual, vane, stamp="2026-05-01T12:00:{h:02d}Z"),
    "future": table(usual, vane, stamp="2199-05-01T12:{m:02d}:{s:02d}Z"),
    "old": table(usual, vane, stamp="1980-05-01T12:{m:02d}:{s:02d}Z"),
    "coarse": PLAIN
    + "".join(
        f"2026-05-{1 + k // 12:02d}T{2 * (k % 12):02d}:00:00Z,{usual(k)},{vane(k)}\n"
        for k in range(60)
    ),
    "lines": table(usual, vane).replace("12:00:30Z", "nonsense"),
}


def test_every_check_has_a_case() -> None:
    assert KEYS - {"below-threshold", "calm-in-words", "zero-beside-360"} == set(
        ODD
    )  # these have tests of their own


def asked(path: Path, options: WindOptions | None = None) -> set[str]:
    """Keys of the doubts that a log opens."""
    with pytest.raises(OpenFactsError) as refused:
        read_log(path, options)
    return {question.example for question in refused.value.questions if question.key == "expect"}


@pytest.mark.parametrize("key", ODD)
def test_what_is_odd_is_asked_and_a_yes_closes_it(key: str, log_file: Write) -> None:
    path = log_file(ODD[key])
    first = asked(path)
    assert key in first
    if key == "order":  # which rows are right is a question of its own: --clock
        return
    assert read_log(path, WindOptions(expect=tuple(first))).drafted


def test_devices_that_follow_one_another_are_asked_about(log_file: Write) -> None:
    """A column that no word calls a site: 2 devices of 200 rows each, so that the time goes back
    only once."""
    made = [
        f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}Z,{pod},{usual(k)}"
        for pod in (17, 23)
        for k in range(200)
    ]
    with pytest.raises(OpenFactsError, match="goes back by 199 s"):
        read_log(log_file("\n".join(["time,pod,wind_speed (m/s)", *made]) + "\n"))


def test_a_usual_log_needs_no_confirmation(log_file: Write) -> None:
    assert read_log(log_file(table(usual, vane))).stated


def test_a_code_for_no_value_is_given(log_file: Write) -> None:
    log = read_log(log_file(ODD["code"].replace("km/h", "m/s")), WindOptions(missing=("99.9",)))
    speed = log.series.channels["wind_speed"]
    assert int(np.isnan(speed).sum()) == 3
    assert np.nanmin(speed) == 4.0


@pytest.mark.parametrize(
    ("gust", "odd"), [(0.9, True), (1.0, False), (1.4, False), (3.2, False), (3.3, True)]
)
def test_gusts_are_1_to_3_2_times_the_wind_of_their_name(
    gust: float, odd: bool, log_file: Write
) -> None:
    text = table(usual, lambda k: f"{gust * usual(k):.4f}").replace(
        "wind_direction (deg)", "wind gust (m/s)"
    )
    path = log_file(text)
    if odd:
        assert asked(path) == {"gust"}
    else:
        assert read_log(path).drafted
    other = text.replace("wind_speed (m/s)", "wind speed 10m (m/s)").replace(
        "wind gust (m/s)", "wind gust 80m (m/s)"
    )
    assert read_log(log_file(other)).drafted  # another height's gusts are of another wind


def test_gusts_in_another_unit_are_compared_in_one(log_file: Write) -> None:
    gusts = table(usual, lambda k: round(3.6 * 1.4 * usual(k), 2)).replace(
        "wind_direction (deg)", "wind gust (km/h)"
    )
    assert read_log(log_file(gusts)).drafted


@pytest.mark.parametrize(
    ("turn", "odd"), [(0, False), (20, False), (40, True), (90, True), (-150, True)]
)
def test_a_direction_that_its_components_contradict_is_asked(
    turn: float, odd: bool, log_file: Write
) -> None:
    path = log_file(HEADING + "".join(blowing(k, vane(k) + turn) for k in range(60)))
    if odd:
        assert asked(path) == {"components"}
    else:
        assert read_log(path).drafted


def test_components_that_turn_by_themselves_contradict_any_direction(log_file: Write) -> None:
    assert asked(log_file(HEADING + "".join(blowing(k, 37 * k) for k in range(60)))) == {
        "components"
    }


@pytest.mark.parametrize(
    ("zero", "others", "odd"),
    [
        (0, (*range(10, 350, 10),), "calm"),
        (0, (*range(10, 350, 10), 360), "zero-beside-360"),
        (0, (*range(3, 360, 10),), ""),
        (340, (*range(10, 350, 10),), ""),
    ],
)
def test_a_zero_where_no_wind_is_near_north_or_360_stands_for_north_is_asked(
    zero: int, others: tuple[int, ...], odd: str, log_file: Write
) -> None:
    path = log_file(table(usual, lambda k: zero if k in (30, 50) else others[k % len(others)]))
    if odd:
        assert odd in asked(path)
    else:
        assert read_log(path).stated


def test_an_unknown_answer_is_refused(log_file: Write) -> None:
    with pytest.raises(UnknownNameError, match="clam"):
        read_log(log_file(table(usual, vane)), WindOptions(expect=("clam",)))


def test_a_recipe_is_read_and_what_speaks_against_its_column_is_reported(
    log_file: Write, tmp_path: Path
) -> None:
    recipe = tmp_path / "own.toml"
    recipe.write_text(
        'name = "own"\nabout = "made"\nsource = "made"\n[time]\ncolumns = ["time"]\nformat = '
        '"iso"\n'
        '[channels.wind_speed]\ncolumn = "wind_speed (m/s)"\nunit = "m/s"\n[sensor]\nname = "own"\n'
    )
    said: dict[str, list[str]] = {}
    for name in ("code", "strong", "steps", "grows", "angles", "fast"):
        text = ODD[name].replace("(km/h)", "(m/s)")
        log = read_log(log_file(text), WindOptions(recipe=str(recipe)))
        said[name] = [found.what for found in log.findings if found.kind == "doubtful-numbers"]
    assert "99.9 m/s occurs 3 times" in said["code"][0]
    assert "median" in said["strong"][0]
    assert "1 mph written in km/h" in said["steps"][0]
    assert "changes, as a sum does" in said["grows"][0]
    assert "whole numbers from 0 to 354" in " ".join(said["angles"])
    assert said["fast"] == []
    recipe.write_text(recipe.read_text() + '[expect]\nconfirmed = ["code"]\n')
    log = read_log(
        log_file(ODD["code"].replace("(km/h)", "(m/s)")), WindOptions(recipe=str(recipe))
    )
    assert "doubtful-numbers" not in {found.kind for found in log.findings}


def seen(speed: FloatArray, unit_name: str, days: float = 0.01) -> str:
    """What the check of steps says of speeds as they are written."""
    time = np.linspace(0, days * 86_400e9, len(speed)).astype(np.int64)
    channels = {"wind_speed": unit(unit_name).to_si(speed)}
    reading = Reading(
        time=time,
        channels=channels,
        flags=np.zeros(len(speed), np.uint16),
        line=np.arange(len(speed)),
        sensor=Sensor(name="made"),
        step=1,
    )
    known = recipes.load("generic-csv")
    assert isinstance(known, recipes.Recipe)
    recipe = replace(known, expect=frozenset(KEYS - {"steps", "strong", "grows"}))
    layout = replace(recipe.channels["wind_speed"], unit=unit_name)
    recipe = replace(recipe, channels={"wind_speed": layout})
    return "; ".join(
        one.text for one in doubts(reading, recipe, assumed=frozenset(), left_out=0, now=0)
    )


WIND: FloatArray = np.asarray(
    5 * np.abs(np.random.default_rng(7).weibull(2.0, 400)), dtype=np.float64
)
"""m/s."""


def test_multiples_of_a_converted_step_show_the_unit_they_are_written_in() -> None:
    cases = [
        ("mph", 1.0, "km/h", 1),
        ("mph", 1.0, "m/s", 2),
        ("kn", 1.0, "m/s", 1),
        ("km/h", 1.0, "m/s", 2),
        ("m/s", 1.0, "km/h", 1),
        ("m/s", 0.1, "km/h", 2),
        ("m/s", 0.1, "mph", 2),
        ("kn", 1.0, "km/h", 1),
    ]
    for native, step, shown, digits in cases:
        counts = np.round(WIND / unit(native).scale / step)
        values = np.round(counts * step * unit(native).scale / unit(shown).scale, digits)
        for stated in ("m/s", "km/h", "mph", "kn"):
            text = seen(values, stated)
            if stated == shown:
                assert text == "", (native, step, shown)
            else:
                assert (
                    f"multiples of {step:g} {native} written in {shown}, and {stated} is stated"
                    in text
                )
    for digits in (0, 1, 2, 6):
        assert seen(np.round(WIND, digits), "m/s") == ""
    assert (
        seen(np.array([0.45, 0.9, 1.34, 1.79, 2.24, 2.68] * 4), "m/s") == ""
    )  # whole mph, 2 as twice 0.45 m/s


def test_days_of_gales_are_odd_and_an_hour_is_not() -> None:
    gale = np.round(18 + 8 * np.random.default_rng(3).random(400), 2)
    assert seen(gale, "m/s") == ""
    assert "the median speed of 2 days is" in seen(gale, "m/s", days=2)
    assert seen(gale, "km/h", days=2) == ""


def test_winds_that_wander_and_steps_of_a_tunnel_are_no_sums() -> None:
    draws = stream(1, "wandering winds")
    wandering = (np.round(np.abs(3 + np.cumsum(draws.normal(0, 0.3, 400))), 1) for _ in range(50))
    assert not [
        speeds
        for speeds in wandering
        if "as a sum" in seen(np.asarray(speeds, dtype=np.float64), "m/s")
    ]
    assert "as a sum" not in seen(np.repeat(np.arange(21, dtype=np.float64), 30), "m/s")
    sums = [
        2.5,
        4,
        8.5,
        11,
        15.5,
        17,
        21.5,
        24,
        1.5,
        3,
        1.5,
        4,
        2.5,
        5,
        9.5,
        11,
        13.5,
        1.5,
        4,
        5.5,
    ] * 2
    assert "as a sum" in seen(np.array(sums), "m/s")
