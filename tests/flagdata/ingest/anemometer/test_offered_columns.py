"""Lines of columns that are offered beside a wind which is read can be given back as they are printed."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def lines(log: WindLog) -> list[str]:
    """The lines of columns that the findings of a log offer, in their order."""
    return [line for found in log.findings for line in re.findall(r'--columns "([^"]*)"', f"{found.what} {found.fix}")]


@pytest.mark.parametrize("before", [0, 9])
def test_a_direction_that_the_user_alone_knows_is_offered_with_one_number_to_fill_in(before: int, read: Read) -> None:
    other = "".join(f"{7 + at};" for at in range(before))
    text = "".join(f"2026-05-01T12:{at:02d}:00Z;{other}{3 + at / 10:.1f};x;{200 + at};5\n" for at in range(20))
    (line,) = lines(read(text, wind=str(before + 2), unit="m/s"))
    assert line.count("?") == 1
    found = read(text, columns=line.replace("?", str(before + 4)))
    assert found.series.channels["wind_speed"].tolist() == pytest.approx([3 + at / 10 for at in range(20)])
    assert np.degrees(found.series.channels["wind_direction"]) == pytest.approx(np.arange(200, 220))


def turns(form: Callable[[int], str], heading: str = "wind dir (deg)") -> str:
    """Rows of a speed, a gust and a direction."""
    rows = "".join(
        f"2026-05-01T12:{at:02d}:00Z,{3 + at % 7 / 10:.1f},{6 + at % 5 / 10:.1f},{form(at)}\n" for at in range(30)
    )
    return f"time,wind speed (m/s),gust (m/s),{heading}\n{rows}"


@pytest.mark.parametrize(
    ("text", "first", "as_stated"),
    [
        (turns(lambda at: str(20 + at % 9)), 200.0, 20.0),
        (turns(lambda at: f"{3 + at / 10:.1f}"), float(np.degrees(3)), 3.0),
        (turns(lambda at: "12", "wind dir"), 270.0, 12.0),
    ],
)
def test_a_gust_is_offered_with_its_direction_in_the_unit_that_the_note_names(
    text: str, first: float, as_stated: float, read: Read
) -> None:
    note, gust = lines(read(text))
    assert [line.rpartition("=")[2] for line in (note, gust)] == [note.rpartition("=")[2]] * 2
    found = read(text, columns=gust)
    assert found.series.channels["wind_speed"][:2].tolist() == pytest.approx([6.0, 6.1])
    assert np.degrees(found.series.channels["wind_direction"][0]) == pytest.approx(first)
    (said,) = [one.what for one in read(text).findings if one.kind == "columns-not-read"]
    assert "wind_direction[deg] for the direction, which is in doubt" in said
    other = read(text, columns=f"{gust.rpartition('=')[0]}=wind_direction[deg]")
    assert np.degrees(other.series.channels["wind_direction"][0]) == pytest.approx(as_stated)


def test_a_gust_beside_a_heading_of_the_wind_is_offered_both_ways(read: Read) -> None:
    text = turns(lambda at: str(200 + at), "wind heading (deg)")
    (said,) = [one.what for one in read(text).findings if one.kind == "columns-not-read"]
    assert '4=wind_direction[deg]", or with wind_direction_to[deg] for the direction' in said


def test_a_speed_in_doubt_is_offered_with_a_question_where_the_direction_is_in_doubt_too(read: Read) -> None:
    text = turns(lambda at: str(20 + at % 9)).replace("wind speed (m/s)", "U (m/s)")
    with pytest.raises(InputError) as caught:
        read(text)
    (line,) = re.findall(r'--columns "([^"]*)"', caught.value.fix or "")
    assert line.endswith("wind_direction[?]")
    found = read(text, columns=line.replace("[?]", "[10 deg]"))
    assert np.degrees(found.series.channels["wind_direction"][0]) == pytest.approx(200)


def test_a_second_direction_is_offered_in_the_place_of_the_first(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at % 7},{200 + at},{100 + at}\n" for at in range(30))
    (line,) = lines(read(f"time,wind speed (m/s),wind dir (deg),TWD\n{rows}"))
    found = read(f"time,wind speed (m/s),wind dir (deg),TWD\n{rows}", columns=line)
    assert np.degrees(found.series.channels["wind_direction"]) == pytest.approx(np.arange(100, 130))


def test_names_of_stations_and_empty_columns_are_not_offered_as_weather(read: Read) -> None:
    stations = [*(f"{letter}QXI1" for letter in "ABCDEFGHKL"), "TS903", "TA417"]
    cells = ",".join(["3.5"] * 11)
    rows = "".join(f"2026-05-01T{at:02d}:00:00Z,{at % 4}.25,{cells},\n" for at in range(24))
    empty = "".join(f"2026-05-01T{at:02d}:00:00Z,{at % 4}.25,{at % 3}.5,\n" for at in range(24))
    for text in (f"time,{','.join(stations)},END\n{rows}", f"time,Q7,R8,TS\n{empty}"):
        with pytest.raises(InputError) as caught:
            read(text)
        assert "temperature" not in (caught.value.fix or "")


def test_a_column_that_is_headed_as_a_wind_and_holds_words_is_not_offered(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,OP,{9 + at % 4}.5,{7 + at % 3}.8\n" for at in range(12))
    text = f"time,Wind Speed (m/s),Max Wind Speed (m/s),Min Wind Speed (m/s)\n{rows}"
    with pytest.raises(InputError) as caught:
        read(text)
    (line,) = re.findall(r'--columns "([^"]*)"', caught.value.fix)
    assert "2=wind_speed" not in line
    found = read(text, columns="1=time,3=wind_speed[m/s]")
    assert found.series.channels["wind_speed"][:2].tolist() == pytest.approx([9.5, 10.5])


def test_the_direction_that_its_heading_names_goes_before_other_angles(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{at}.5,{200 + at}\n" for at in range(12))
    with pytest.raises(InputError) as caught:
        read(f"time,R_u [deg],Wind direction [degrees]\n{rows}")
    assert "wind_direction[deg]" in (caught.value.fix or "")
    assert re.search(r'--columns "time,[^,]*,wind_direction\[deg\]', caught.value.fix or "")


def test_nothing_in_place_of_a_question_mark_is_no_column(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{200 + at}\n" for at in range(12))
    log = read(f"time,angle\n{rows}", columns="1=time,2=wind_direction[deg],=wind_speed[]")
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx(np.arange(200, 212))


def test_the_direction_of_an_extreme_is_not_offered_beside_a_mean(read: Read) -> None:
    rows = "".join(f"2026-05-{day:02d};{3 + day / 10:.1f};{200 + day};{9 + day / 10:.1f}\n" for day in range(1, 20))
    with pytest.raises(FlagdataError) as caught:
        read(f"date;avgwindspeed;fastest2minwinddir;fastest2minwindspeed\n{rows}", zone="UTC", unit="mph")
    (line, *_) = re.findall(r'--columns "([^"]*)"', str(caught.value.fix))
    assert "direction" not in line
