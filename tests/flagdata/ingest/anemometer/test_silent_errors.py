"""The kinds of silent error that were found in real logs, one row each: refused, asked, or shown in
the preview."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest import Drafted, OpenFactsError, WindOptions, read_log
from tests.flagdata.ingest.anemometer.cases import sentence

Write = Callable[[str | bytes], Path]
REFUSED, ASKED, SHOWN = "refused", "asked", "shown"
REPORTED = "reported"
"""Read by the exact format that recognised it, with a finding about the very thing."""


def rows(form: str, count: int = 30) -> str:
    """Rows of `form` at each second `s`, with a speed `v`, a second one `w`, a direction `d` and a
    count `n`."""
    return "".join(
        form.format(
            s=s, v=f"{4 + s % 7 / 10:.1f}", w=f"{6 + s % 5 / 10:.1f}", d=200 + s % 9, n=s + 1
        )
        + "\n"
        for s in range(count)
    )


T = "2026-05-01T12:00:{s:02d}Z"


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of error that entered silently.

    Attributes:
        text: a file of that kind.
        ends: how it ends, with `options`.
        shows: what the question, the refusal or the preview says of it.
        options: the user's answers, with which the error could come in.
        first: how it ends without them, where that differs.
        channels: that are read of it, if any.
        given: whether the answers leave nothing that is inferred.
    """

    text: str
    ends: str
    shows: str
    options: Mapping[str, object] = field(default_factory=dict)
    first: str = ""
    channels: Collection[str] = frozenset({"wind_speed"})
    given: bool = False


KINDS: dict[str, Kind] = {
    "a mean cube as a wind": Kind(
        text="time,WS_ms_Avg(5m),WS3_Avg(5m)\n" + rows(T + ",{v},{n}"),
        ends=ASKED,
        shows="WS3_Avg(5m)",
    ),
    "JSON of stations at the first one's time": Kind(
        text='{"stations": [{"t": "2026-05-01T12:00:00Z", "wind_speed": 4.0}]}\n',
        ends=REFUSED,
        shows="objects",
    ),
    "JSON of two stations with a list of readings each": Kind(
        text='{"a": [{"t": 1}], "b": [{"t": 1}]}\n', ends=REFUSED, shows="objects"
    ),
    "a direction VDir[gr] as the speed": Kind(
        text="time,VDir[gr],VVel[m/s]\n" + rows(T + ",{d},{v}"),
        ends=ASKED,
        shows="which column is the wind's speed",
    ),
    "hours across as winds": Kind(
        text="date,H1,H2,H3\n" + rows("2026-05-{n:02d},{v},{w},{v}", 20), ends=ASKED, shows="H1"
    ),
    "gusts ff3 beside Ff as a second wind": Kind(
        text="time,Ff [m/s],ff3 [m/s]\n" + rows(T + ",{v},{w}"), ends=ASKED, shows="ff3"
    ),
    "rows that are shorter lost": Kind(
        text="station,time,wind_speed (m/s),x\n"
        + rows("A," + T + ",{v},1", 60)
        + rows("B,2026-05-01T12:01:{s:02d}Z,{v}", 3),
        ends=ASKED,
        shows="2 lines (3%) were left out",
    ),
    "components as winds of their own": Kind(
        text="time,u_rot [m/s],v_rot [m/s],wind_speed [m/s]\n" + rows(T + ",{v},0.1,{w}"),
        ends=SHOWN,
        shows="'u_rot [m/s]', 'v_rot [m/s]'",
    ),
    "a speed with the direction of another height": Kind(
        text="time,Wind speed 80m (m/s),Wind dir 40m (deg)\n" + rows(T + ",{v},{d}"),
        ends=SHOWN,
        shows="not used: 'Wind dir 40m (deg)'",
    ),
    "a letter that marks rows as a direction": Kind(
        text="time,wind_speed (m/s),wind dir\n" + rows(T + ",{v},E"), ends=ASKED, shows="every row"
    ),
    "an offset cut off as a column": Kind(
        text="time,wind,dir\n" + rows("2026-05-01 12:00:{s:02d}-05:00,{v},{d}"),
        ends=SHOWN,
        first=ASKED,
        shows="2026-05-01T17:00:00Z  4.00 m/s from 200°",
        options={"unit": "m/s"},
        channels={"wind_speed", "wind_direction"},
    ),
    "a vessel's wind from the bow as the wind": Kind(
        text="time,AWS (kn),AWA (deg),SOG (kn)\n" + rows(T + ",{w},{d},{v}"),
        ends=ASKED,
        shows="'AWS (kn)' speaks of a platform that moves",
        options={"wind": "AWS (kn)"},
    ),
    "rows among other lines above the table lost": Kind(
        text=rows(T + ";{v};1", 3) + "second part\ntime,wind_speed [m/s]\n" + rows(T + ",{v}"),
        ends=SHOWN,
        shows="4 lines above are not read, as line 1 '2026-05-01T12:00:00Z;4.0;1'",
    ),
    "hours and minutes as milliseconds": Kind(
        text="time,wind_speed (m/s)\n" + rows("12{n:02d},{v}"),
        ends=SHOWN,
        first=ASKED,
        shows="1201,4.0  →  2026-05-01T12:01:00Z",
        options={"date": dt.date(2026, 5, 1), "zone": "UTC"},
    ),
    "one station committed before another was refused": Kind(
        text="time,wind A (m/s),wind B (m/s)\n" + rows(T + ",{v},{w}"),
        ends=ASKED,
        shows="2 anemometers",
    ),
    "0 beside 360 as north where it is calm": Kind(
        text="time,wind_speed (m/s),wind_direction (deg)\n"
        + rows(T + ",0.0,0", 4)
        + rows("2026-05-01T12:01:{s:02d}Z,{v},360", 4)
        + rows("2026-05-01T12:02:{s:02d}Z,{v},{d}"),
        ends=ASKED,
        shows="not calm air or a variable wind",
    ),
    "a heading of hours as a first sample": Kind(
        text=",".join(map(str, range(5))) + "\n" + rows("{v},{w},{v},{w},{v}"),
        ends=REFUSED,
        shows="neither a table",
    ),
    "two sonics under the same headings": Kind(
        text="time,wind speed (m/s),wind dir (deg),wind speed (m/s),wind dir (deg)\n"
        + rows(T + ",{v},{d},{w},{n}"),
        ends=SHOWN,
        first=ASKED,
        shows="not used: 'wind speed (m/s)' (number 2), 'wind dir (deg)' (number 3)",
        options={"wind": "wind speed (m/s) (column 4)"},
    ),
    "a speed of tower N with the direction of tower S": Kind(
        text="time,speed_N (m/s),dir_S (deg),dir_N (deg)\n" + rows(T + ",{v},{d},{n}"),
        ends=SHOWN,
        shows="'dir_S (deg)', 'dir_N (deg)'",
    ),
    "rows without their last cells lost": Kind(
        text="time,wind_speed (m/s),a,b\n"
        + rows(T + ",{v},1,2", 5)
        + rows("2026-05-01T12:01:{s:02d}Z,{v}"),
        ends=SHOWN,
        first=ASKED,
        shows="6 lines above are not read, as line 2 '2026-05-01T12:00:00Z,4.0,1,2'",
        options={"columns": "1=time,2=wind_speed[m/s]"},
    ),
    "a file of directions alone": Kind(
        text="time,wind_direction (deg)\n" + rows(T + ",{d}"),
        ends=ASKED,
        shows="which column is the wind's speed",
    ),
    "counts and no speed": Kind(
        text="time,wind counts,roll (deg)\n" + rows(T + ",{n},{d}"),
        ends=ASKED,
        shows="which column",
    ),
    "a lidar's file of nothing but zeros": Kind(
        text="time,wind_speed (m/s),wind_direction (deg)\n" + rows(T + ",0,0"),
        ends=ASKED,
        shows="every speed is 0",
    ),
    "a direction of 0 at speeds up to 0.1 alone": Kind(
        text="time,wind_speed (m/s),wind_direction (deg)\n"
        + rows(T + ",0.1,0", 3)
        + rows("2026-05-01T12:01:{s:02d}Z,{v},{d}"),
        ends=ASKED,
        shows="up to 0.2 m/s",
    ),
    "a boat's own speed as the wind": Kind(
        text="time,speed (kn),aws (kn),tws (kn)\n" + rows(T + ",{v},{w},{w}"),
        ends=ASKED,
        shows="which column is the wind's speed? 'time', 'speed (kn)', 'aws (kn)', 'tws (kn)'",
        options={"platform": "moving"},
    ),
    "angles to the bow with their side in a column": Kind(
        text="time,wind speed (kn),bow angle (deg),side\n" + rows(T + ",{v},{n},L"),
        ends=SHOWN,
        first=ASKED,
        shows="not used: 'bow angle (deg)', 'side'",
        options={"platform": "moving"},
        channels={"apparent_wind_speed"},
        given=True,
    ),
    "the day's mean with the direction of the fastest": Kind(
        text="date,wind speed mean (m/s),wind dir max (deg)\n"
        + rows("2026-05-{n:02d},{v},{d}", 20),
        ends=SHOWN,
        first=ASKED,
        shows="not used: 'wind dir max (deg)'",
        options={"zone": "UTC", "expect": ("coarse",)},
    ),
    "a table of fixed width with empty cells": Kind(
        text="time wind temp\n"
        + rows(T + " {v} 20", 10)
        + rows("2026-05-01T12:01:{s:02d}Z {v}", 10),
        ends=SHOWN,
        first=ASKED,
        shows="11 lines above are not read, as line 2 '2026-05-01T12:00:00Z 4.0 20'",
        options={"columns": "1=time,2=wind_speed[m/s]"},
    ),
    "rows over several lines": Kind(
        text="time,wind_speed (m/s),note\n"
        + rows(T + ",{v},x", 40)
        + '2026-05-01T12:01:00Z,4.0,"a\nb"\n',
        ends=ASKED,
        shows="1 lines (2%) were left out",
    ),
    "JSON of named places with a reading each": Kind(
        text='{"north": {"ws": 4}, "south": {"ws": 5}}\n', ends=REFUSED, shows="objects"
    ),
    "the day's highest mean wind in Norwegian": Kind(
        text="time;Høyeste middelvind (m/s)\n" + rows("2026-05-01T12:00:{s:02d}Z;{v}"),
        ends=ASKED,
        shows="which column is the wind's speed? 'time', 'Høyeste middelvind (m/s)'",
    ),
    "a computer's stamps before sentences left out": Kind(
        text="".join(
            f"20260501 1200{s:02d}+00:00 {line}\n"
            for s in range(5, 30)
            for line in (
                sentence("WIMWV,200.0,R,3.5,M,A"),
                sentence(f"GPZDA,1200{s - 5:02d}.50,01,05,2026,00,00"),
            )
        ),
        ends=REPORTED,
        shows="is 4.5 s behind the stamps of the lines, which are taken",
        options={"platform": "fixed", "azimuth": 0.0},
        channels={"wind_speed", "wind_direction"},
    ),
    "a variable wind written as 0": Kind(
        text="time,wind_speed (kn),wind_direction (deg)\n"
        + rows(T + ",{v},000", 5)
        + rows("2026-05-01T12:01:{s:02d}Z,{v},{d}"),
        ends=ASKED,
        shows="within 30° of north",
    ),
    "a calm hour written as 0 among whole tens": Kind(
        text="time,wind_speed (m/s),wind dir\n"
        + rows(T + ",0,0", 3)
        + rows("2026-05-01T12:01:{s:02d}Z,{v},20"),
        ends=ASKED,
        shows="no unit is stated",
    ),
    "year, month, day and day of the year without names": Kind(
        text=rows("2026,5,1,121,{v},{d}"), ends=ASKED, shows="which column"
    ),
    "fractions of a day in two digits": Kind(
        text="day,wind_speed (m/s)\n" + rows("46143.{n:02d},{v}"),
        ends=ASKED,
        shows="no column reads as a time",
    ),
    "vanes of a mast as three winds": Kind(
        text="time,98m WV [?],80m Avg [m/s]\n" + rows(T + ",{d},{v}"),
        ends=ASKED,
        shows="the median speed is 56.5 m/s",
        options={"wind": "98m WV [?]", "unit": "km/h"},
    ),
    "the maximum of a day beside hourly readings": Kind(
        text="time,wind_speed (m/s),wind max day (m/s)\n" + rows(T + ",{v},{w}"),
        ends=SHOWN,
        shows="not used: 'wind max day (m/s)'",
    ),
    "the time of a day's gust as a count of seconds": Kind(
        text="DATE,HXI3S,FF (m/s)\n" + rows("202605{n:02d},1430,{v}", 20),
        ends=SHOWN,
        first=ASKED,
        shows="not used: 'HXI3S'",
        options={"zone": "UTC", "expect": ("coarse",)},
    ),
    "a station's peak gust as a wind of its own": Kind(
        text="time,WS (m/s),WG (m/s)\n" + rows(T + ",{v},{w}"),
        ends=SHOWN,
        shows="not used: 'WG (m/s)'",
    ),
    "a lidar's availability as the direction": Kind(
        text="time,WS (m/s),availability (%)\n" + rows(T + ",{v},100"),
        ends=SHOWN,
        shows="not used: 'availability (%)'",
    ),
    "a gust with the direction of another gust": Kind(
        text="<?xml version='1.0'?>\n<gust dir='200'>5</gust>\n", ends=REFUSED, shows="XML"
    ),
    "a mean cube of few rows": Kind(
        text="time,WS3_Avg(5m)\n" + rows(T + ",{n}", 4), ends=ASKED, shows="WS3_Avg(5m)"
    ),
    "names and values in Persian": Kind(
        text="زمان,نام,مقدار\n" + rows(T + ",باران,{v}"),
        ends=SHOWN,
        first=REFUSED,
        shows="not used: 'نام'",
        options={"columns": "1=time,3=wind_speed[m/s]"},
    ),
}


def test_there_are_forty_four_kinds() -> None:
    assert len(KINDS) == 44


def ended(path: Path, kind: Kind, options: Mapping[str, object]) -> tuple[str, str]:
    """How reading a file ends, and the messages."""
    try:
        log = read_log(path, WindOptions(**options))  # type: ignore[arg-type]
    except OpenFactsError as error:
        return ASKED, error.what
    except FlagdataError as error:
        return REFUSED, str(error)
    assert set(log.series.channels) == kind.channels
    if not log.drafted:
        return REPORTED, "\n".join(f.what for f in log.findings)
    assert not log.stated or (kind.given and options)
    return SHOWN, Drafted(
        path=path, source_hash="", readings=((log, WindOptions(**options)),)
    ).preview()  # type: ignore[arg-type]


@pytest.mark.parametrize("name", KINDS)
def test_no_kind_enters_without_a_word(name: str, log_file: Write) -> None:
    kind = KINDS[name]
    path = log_file(kind.text)
    how, text = ended(path, kind, kind.options)
    assert how == kind.ends, text
    assert kind.shows in text
    if kind.ends != REPORTED:
        assert ended(path, kind, {})[0] == (kind.first or kind.ends)
