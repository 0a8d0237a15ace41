"""NMEA 0183: published sentences, and the laws of streams."""

from __future__ import annotations

import datetime as dt
from functools import reduce
from operator import xor

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from flagdata.ingest import Head, checksum
from flagdata.ingest.anemometer.formats.nmea import Nmea
from flagdata.ingest.anemometer.formats.nmea_sentences import ChecksumError, clock, split, tag_time
from flagdata.ingest.anemometer.formats.stamped_nmea import StampedNmea
from flagdata.timebase import iso
from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.conftest import read

DATE = dt.date(2026, 5, 1)


def stream(*bodies: str) -> str:
    return "\r\n".join([*map(sentence, bodies), ""])


# Sentences as gpsd's "NMEA Revealed" and vendors' manuals print them, checksums included.
PUBLISHED = [
    "$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47",
    "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A",
    "$GPGLL,4916.45,N,12311.12,W,225444,A,*1D",
    "$GPVTG,054.7,T,034.4,M,005.5,N,010.2,K*48",
    "$WIMWV,214.8,R,0.1,K,A*28",
    "$GPZDA,201530.00,04,07,2002,00,00*60",
]


@pytest.mark.parametrize("text", PUBLISHED)
def test_published_checksums_are_right(text: str) -> None:
    sentence = split(text)
    assert sentence is not None
    assert sentence.checked


@pytest.mark.parametrize("text", PUBLISHED)
def test_a_changed_digit_breaks_the_checksum(text: str) -> None:
    at = next(i for i, c in enumerate(text) if c.isdigit())
    with pytest.raises(ChecksumError):
        split(text[:at] + str((int(text[at]) + 1) % 10) + text[at + 1 :])


def test_a_published_wind_sentence_says_what_its_manual_says() -> None:
    # 214.8° relative, 0.1 km/h, valid
    sentence = split(PUBLISHED[4])
    assert sentence is not None
    assert (sentence.talker, sentence.kind, sentence.fields) == (
        "WI",
        "MWV",
        ("214.8", "R", "0.1", "K", "A"),
    )


@pytest.mark.parametrize(
    ("text", "nanoseconds"),
    [
        ("000000", 0),
        ("123519", 45_319 * 10**9),
        ("235959.99", 86_399_990_000_000),
        ("235960", 86_399_999_999_999),
    ],
)
def test_times_of_day(text: str, nanoseconds: int) -> None:
    assert clock(text) == nanoseconds


@pytest.mark.parametrize("text", ["", "240000", "126000", "12351", "1235199", "x", "12:35:19"])
def test_what_is_no_time_of_day(text: str) -> None:
    assert clock(text) is None


def test_wind_takes_its_time_from_the_sentences_around_it() -> None:
    # one wind sentence in the middle of two lines between seconds 0 and 3, one third on
    log = read(
        stream(
            "GPZDA,120000,01,05,2026,,",
            "WIMWV,010,R,5.0,M,A",
            "GPHDT,1,T",
            "GPZDA,120003,01,05,2026,,",
        )
    )
    assert iso(int(log.series.time[0])) == "2026-05-01T12:00:01Z"
    assert log.series.flags.tolist() == [SampleFlag.TIME_UNSURE]


def test_the_stream_may_begin_and_end_with_wind() -> None:
    wind = "WIMWV,010,R,5.0,M,A"
    log = read(stream(wind, "GPZDA,120000,01,05,2026,,", wind, "GPZDA,120002,01,05,2026,,", wind))
    assert [iso(t)[11:] for t in log.series.time.tolist()] == [
        "11:59:59Z",
        "12:00:01Z",
        "12:00:03Z",
    ]


def test_midnight_adds_a_day() -> None:
    times = [
        "GPGGA,235958,,,,,,,,,,,,,",
        "GPGGA,235959,,,,,,,,,,,,,",
        "GPGGA,000000,,,,,,,,,,,,,",
        "GPGGA,000001,,,,,,,,,,,,,",
    ]
    log = read(
        stream(*(s for t in times for s in (t, "WIMWV,010,R,5.0,M,A"))), date=dt.date(2026, 12, 31)
    )
    assert [iso(t)[:10] for t in log.series.time.tolist()] == [
        "2026-12-31",
        "2026-12-31",
        "2027-01-01",
        "2027-01-01",
    ]


def test_a_one_digit_hour_with_a_fraction_before_a_sentence_is_read() -> None:
    lines = stream(*("WIMWV,010,R,5.0,M,A",) * 3).splitlines()
    text = "\n".join(f"9:05:0{i}.250 {line}" for i, line in enumerate(lines))
    log = read(text, date=dt.date(2026, 5, 1), zone="UTC")
    assert [iso(t) for t in log.series.time.tolist()] == [
        f"2026-05-01T09:05:0{i}.250Z" for i in range(3)
    ]


def test_a_night_without_rows_is_a_midnight_in_times_of_day() -> None:
    """Rows from 09:00 to 17:00, the next day from 09:00 on: a fall of eight hours."""
    sentence = stream("WIMWV,010,R,5.0,M,A").strip()
    hours = [*range(9, 18), *range(9, 18)]
    ends = [
        "2026-05-01T09:00:00Z",
        "2026-05-01T17:00:00Z",
        "2026-05-02T09:00:00Z",
        "2026-05-02T17:00:00Z",
    ]
    sentences = "\n".join(f"{hour:02d}:00:00 {sentence}" for hour in hours)
    rows = "".join(f"{hour:02d}:00:00,{4 + i % 3}\n" for i, hour in enumerate(hours))
    for text, columns in ((sentences, None), (rows, "time[%H:%M:%S],wind_speed[m/s]")):
        log = read(text, date=dt.date(2026, 5, 1), zone="UTC", columns=columns)
        assert [iso(int(log.series.time[i])) for i in (0, 8, 9, 17)] == ends
        (finding,) = [one for one in log.findings if one.kind == "date-given"]
        assert "1 midnights follow" in finding.what


def test_a_date_from_rmc_serves_times_from_gga() -> None:
    rmc = "GPRMC,120001,A,,,,,0.1,,010526,,"
    body = [s for i in range(6) for s in (f"GPGGA,12000{i},,,,,,,,,,,,,", "WIMWV,010,R,5.0,M,A")]
    log = read(stream(*body[:4], rmc, *body[4:]))
    assert iso(int(log.series.time[0])).startswith("2026-05-01T12:00:00")


def test_the_most_trusted_time_sentence_is_used() -> None:
    # GLL lags by 7 s here; ZDA is there as often and goes before it
    wind = "WIMWV,1,R,5.0,M,A"
    body = [
        sentence
        for i in range(10)
        for sentence in (
            f"GPGLL,1,N,2,E,1200{i:02d},A",
            f"GPZDA,1200{i + 7:02d},01,05,2026,,",
            wind,
        )
    ]
    log = read(stream(*body))
    assert (
        next(f for f in log.findings if f.kind == "time-interpolated")
        .what.split("between ")[1]
        .startswith("10 ZDA")
    )
    assert iso(int(log.series.time[0])).startswith("2026-05-01T12:00:07")


def test_tag_blocks_carry_whole_instants() -> None:
    def tagged(second: int) -> str:
        tag = f"s:x,c:{1_777_636_800 + second}"
        return f"\\{tag}*{reduce(xor, tag.encode()):02X}\\" + sentence("WIMWV,010,R,5.0,M,A")

    log = read("\r\n".join(tagged(i) for i in range(5)))
    assert [iso(t) for t in log.series.time.tolist()] == [
        f"2026-05-01T12:00:0{i}Z" for i in range(5)
    ]


def test_a_tag_block_with_a_wrong_checksum_is_ignored() -> None:
    assert tag_time("\\c:1777636800*00\\") is None


def times(*bodies: str) -> str:
    """One wind sentence a second."""
    return stream(
        *(s for i, b in enumerate(bodies) for s in (f"GPZDA,1200{i:02d},01,05,2026,,", b))
    )


def test_knots_kilometres_and_miles_become_metres_a_second() -> None:
    log = read(
        times("WIMWV,1,R,10,N,A", "WIMWV,1,R,36,K,A", "WIMWV,1,R,10,M,A", "WIMWV,1,R,10,S,A")
    )
    assert log.series.channels["apparent_wind_speed"] == pytest.approx(
        [10 * 1852 / 3600, 10, 10, 4.4704]
    )


def test_of_a_speed_in_several_units_the_finest_is_read() -> None:
    log = read(times("WIVWR,80,L,20.5,N,10.5,M,38,K", "WIVWR,80,L,20.5,N,10.5,M,37.9,K"))
    assert log.series.channels["apparent_wind_speed"] == pytest.approx(
        [20.5 * 1852 / 3600, 37.9 / 3.6]
    )


def test_a_talker_without_values_is_left_out_beside_one_that_has_some() -> None:
    empty = f"IIMDA{',' * 20}"
    log = read(times("WIMWV,1,R,10,N,A", empty, "WIMWV,1,R,12,N,A"))
    assert len(log.series.time) == 2
    assert log.series.sensor.name == "NMEA 0183 talker WI"
    assert any("talker II are empty" in found.what for found in log.findings)


def test_text_before_sentences_that_may_be_a_time_is_reported() -> None:
    lines = times("WIMWV,1,R,10,N,A", "WIMWV,1,R,12,N,A").splitlines()
    log = read("\r\n".join(f"day 121 at 43{index:03d} {line}" for index, line in enumerate(lines)))
    (found,) = [found for found in log.findings if found.kind == "text-before-sentences"]
    assert found.count == 4
    assert "day 121 at 43000" in found.what


def test_sentences_of_a_makers_own_are_sentences() -> None:
    log = read(f"{times('WIMWV,1,R,10,N,A', 'WIMWV,1,R,10,N,A')}\r\n{stream('PSMDCN,2')}")
    assert not [found for found in log.findings if found.kind == "malformed-lines"]


def test_mwd_is_wind_over_ground() -> None:
    log = read(
        times(
            "WIMWD,090.0,T,087.0,M,10.0,N,5.14,M",
            "WIMWD,100.0,T,097.0,M,10.0,N,,M",
            "WIMWD,110.0,T,,M,,N,5.3,M",
        )
    )
    assert log.series.channels["wind_speed"] == pytest.approx([5.14, 10 * 1852 / 3600, 5.3])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([90, 100, 110])
    assert np.degrees(log.series.channels["wind_direction_magnetic"][:2]) == pytest.approx([87, 97])
    assert np.isnan(log.series.channels["wind_direction_magnetic"][2])


def test_a_fixed_mast_measures_wind_over_ground() -> None:
    log = read(
        times("WIMWV,350,R,5,M,A", "WIMWV,020,R,6,M,A"), platform="fixed", azimuth=np.radians(30)
    )
    assert log.series.channels["wind_speed"] == pytest.approx([5, 6])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([20, 50])


def test_a_fixed_mast_of_unknown_azimuth_keeps_its_own_direction() -> None:
    log = read(times("WIMWV,350,R,5,M,A", "WIMWV,020,R,6,M,A"), platform="fixed")
    assert sorted(log.series.channels) == ["apparent_wind_direction", "wind_speed"]


def test_an_azimuth_without_directions_is_refused() -> None:
    with pytest.raises(UsageError, match="no directions"):
        read(times("WIMWV,,R,5,M,A", "WIMWV,,R,6,M,A"), platform="fixed", azimuth=0.5)


def test_an_azimuth_beside_wind_over_ground_is_refused() -> None:
    with pytest.raises(UsageError, match="over ground itself"):
        read(
            times("WIMWD,090.0,T,087.0,M,10.0,N,5.1,M", "WIMWV,1,R,6,M,A"),
            platform="fixed",
            azimuth=0.5,
        )


def test_a_platform_given_as_moving_is_taken_as_moving() -> None:
    log = read(times("WIMWV,1,R,5,M,A", "WIMWV,1,R,6,M,A"), platform="moving")
    assert next(f for f in log.findings if f.kind == "apparent-wind-only").fix is None


def test_one_talker_of_several_can_be_chosen() -> None:
    text = times("WIMWV,1,R,5,M,A", "IIMWV,1,R,6,M,A", "WIMWV,1,R,7,M,A")
    assert read(text, talker="WI").series.channels["apparent_wind_speed"].tolist() == [5, 7]


def test_relative_and_theoretical_never_share_a_channel() -> None:
    log = read(times("WIMWV,010,R,5,M,A", "WIMWV,020,T,3,M,A"))
    assert log.series.channels["apparent_wind_speed"][0] == 5
    assert np.isnan(log.series.channels["apparent_wind_speed"][1])
    assert log.series.channels["theoretical_wind_speed"][1] == 3


def test_our_checksum_is_the_standards() -> None:
    assert checksum("GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,") == 0x47


def test_a_stream_of_two_kinds_of_wind_says_how_many_of_each_and_how_often() -> None:
    # one sentence every 2 s, relative and theoretical in turn: each kind comes every 4 s
    bodies = []
    for second in range(0, 40, 2):
        bodies += [
            f"GPZDA,1200{second:02d}.00,01,05,2026,00,00",
            f"WIMWV,010.0,{'RT'[second // 2 % 2]},5.{second % 7},M,A",
        ]
    log = read(stream(*bodies, "GPZDA,120040.00,01,05,2026,00,00"))
    (finding,) = [f for f in log.findings if f.kind == "wind-kinds"]
    assert finding.count == 20
    assert (
        "10 relative (MWV,R), one every 4 s; 10 theoretical (MWV,T), one every 4 s" in finding.what
    )


def test_a_stream_of_one_kind_of_wind_needs_no_such_count() -> None:
    log = read(
        stream(
            "GPZDA,120000.00,01,05,2026,00,00",
            "WIMWV,010.0,R,5.0,M,A",
            "GPZDA,120002.00,01,05,2026,00,00",
        )
    )
    assert "wind-kinds" not in {f.kind for f in log.findings}


def _signed(*bodies: str) -> str:
    return "".join(f"{sentence(body)}\n" for body in bodies)


def test_sentences_that_others_stand_for_are_counted() -> None:
    rows: list[str] = []
    for at in range(6):
        rows += [f"GPZDA,1200{2 * at:02d},01,05,2026,00,00", f"IIMWV,31{at},T,08.{at}0,N,A"]
        rows += [f"IIVWT,04{at},L,08.{at}0,N,04.17,M,,"] * 2
    found = {f.kind: f for f in read(_signed(*rows)).findings}
    assert found["sentences-not-read"].count == 12
    assert "12 VWT" in found["sentences-not-read"].what
    assert "MWV,T" in found["sentences-not-read"].what


@pytest.mark.parametrize("first", [False, True])
def test_one_time_gives_a_few_readings_its_second(first: bool) -> None:
    winds = ["WIMWV,080.5,R,10.0,N,A", "WIMWV,120.0,T,12.0,N,A", "WIMWV,081.0,R,11.0,N,A"]
    stamp = ["GPZDA,120000,01,05,2026,00,00"]
    log = read(_signed(*(stamp + winds if first else winds + stamp)))
    away = (log.series.time - 1_777_636_800 * 10**9) / 1e9
    assert np.all(np.diff(away) > 0)
    assert np.all(np.abs(away) < 1)
    assert np.all(away > 0) if first else np.all(away < 0)
    assert "one-time" in {finding.kind for finding in log.findings}


def test_one_time_of_a_long_stream_is_not_enough() -> None:
    rows = [f"WIMWV,0{at}.5,R,1{at % 9}.0,N,A" for at in range(10, 40)]
    with pytest.raises(TimeError, match="only one time"):
        read(_signed(*rows, "GPZDA,120000,01,05,2026,00,00"))


BURST = [
    "GPRMC,{clock},A,,,,,0.1,,230526,,",
    "WIMWV,{angle},R,5.0,M,A",
    "WIMWV,{angle},T,4.0,M,A",
    "GPHDT,1,T",
]


def bursts(order: tuple[int, ...], *, skipped: int = 0, step: int = 75, count: int = 8) -> str:
    """Sentences of a burst in this order, the bursts `step` seconds apart; the first lacks its
    first lines."""
    bodies: list[str] = []
    for at in range(count):
        seconds = at * step
        clock = f"11{seconds // 60:02d}{seconds % 60:02d}"
        bodies += [BURST[index].format(clock=clock, angle=f"{at:03d}") for index in order]
    return stream(*bodies[skipped:])


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (1, 2, 3, 0), (3, 1, 0, 2)])
def test_a_sentence_of_a_burst_has_the_time_of_its_burst(order: tuple[int, ...]) -> None:
    log = read(bursts(order))
    known = np.isfinite(log.series.channels["apparent_wind_speed"])
    seconds = (log.series.time - log.series.time[0]) / 1e9
    angle = np.degrees(log.series.channels["apparent_wind_direction"][known])
    assert seconds[known].tolist() == pytest.approx((75 * angle).tolist(), abs=0.01)
    (said,) = [finding.what for finding in log.findings if finding.kind == "time-of-burst"]
    assert "bursts 75 s apart" in said
    assert iso(int(log.series.time[0]))[11:19] == "11:00:00"
    assert (log.series.flags & SampleFlag.TIME_UNSURE).all()


def test_a_stream_that_begins_within_a_burst_is_timed_by_the_bursts_end() -> None:
    log = read(bursts((0, 1, 2, 3), skipped=2))
    known = np.isfinite(log.series.channels["apparent_wind_speed"])
    assert iso(int(log.series.time[known][0]))[11:19] == "11:01:15"


@pytest.mark.parametrize("bodies", [1, 6])
def test_marks_a_second_apart_or_winds_that_come_more_often_are_still_interpolated(
    bodies: int,
) -> None:
    wind = ["WIMWV,010,R,5.0,M,A"] * bodies
    step = 1 if bodies == 1 else 60
    clocks = [f"12{at * step // 60:02d}{at * step % 60:02d}" for at in range(6)]
    log = read(
        stream(*(s for clock in clocks for s in (f"GPRMC,{clock},A,,,,,0.1,,010526,,", *wind)))
    )
    assert "time-interpolated" in {finding.kind for finding in log.findings}


def test_older_sentences_are_called_by_their_own_names() -> None:
    bodies = []
    for second in range(0, 20, 2):
        bodies += [
            f"GPZDA,1200{second:02d}.00,01,05,2026,00,00",
            f"IIVWR,80,L,5.{second % 7},N,,,,",
        ]
        bodies += [
            f"IIVWT,70,L,4.{second % 7},N,,,,",
            f"IIMDA,,,,,,,,,,,,,260.3,T,249.9,M,{second}.8,N,,M",
        ]
    log = read(stream(*bodies, "GPZDA,120020.00,01,05,2026,00,00"))
    (finding,) = [f for f in log.findings if f.kind == "wind-kinds"]
    assert all(
        name in finding.what
        for name in ("relative (VWR)", "theoretical (VWT)", "over ground (MDA)")
    )
    assert "MW" not in finding.what


MDA = "WIMDA,29.8,I,1.0,B,22.0,C,,,78.3,,18.0,C,260.3,T,249.9,M,1.8,N,0.9,M"


@pytest.mark.parametrize(
    ("speed", "options", "says", "fix"),
    [
        ("", {}, "(MDA): if its platform moves", "--platform fixed"),
        (
            "",
            {"platform": "moving"},
            "(MDA) was computed by the instrument from heading and speed of a moving",
            "",
        ),
        (
            "6.0",
            {},
            (
                "(MDA) was computed by the instrument from heading and speed of a platform that moves "
                "at 6"
            ),
            "",
        ),
    ],
)
def test_a_wind_over_ground_is_reported_as_computed_where_something_moves(
    speed: str, options: dict[str, str], says: str, fix: str
) -> None:
    times = [
        f"GPRMC,12000{second}.00,A,5759.0,N,01144.3,E,{speed},28.27,010526,,,A" for second in (0, 1)
    ]
    log = read(stream(times[0], MDA, times[1]), **options)
    (said,) = [f for f in log.findings if f.kind == "computed-true-wind"]
    assert says in said.what
    assert fix in (said.fix or "")


def test_a_wind_that_the_stream_states_over_ground_is_called_so_on_a_fixed_platform() -> None:
    times = [f"GPZDA,12000{second}.00,01,05,2026,00,00" for second in (0, 2)]
    log = read(stream(times[0], MDA, times[1]), platform="fixed")
    (said,) = [f for f in log.findings if f.kind == "fixed-platform"]
    assert said.what.endswith("the wind over ground is that of MDA")


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (
            ["$IIVWR,80,L,5.1,N,,,,"] * 3,
            "3 of the first 3 lines are NMEA 0183 sentences, none of them with a checksum",
        ),
        (
            [sentence(MDA)] * 2,
            (
                "2 of the first 2 lines are NMEA 0183 sentences with right checksums; 0 more have a "
                "wrong"
            ),
        ),
        (
            [sentence(MDA), f"${MDA}"],
            "2 of the first 2 lines are NMEA 0183 sentences, 1 of them with a checksum; 0 more",
        ),
    ],
)
def test_only_checksums_that_are_there_are_reported_as_right(lines: list[str], says: str) -> None:
    guess = Nmea().recognise(Head(lines=tuple(lines)))
    assert guess is not None
    assert guess.reasons[0].startswith(says)


WITHOUT_WIND = [
    sentence(body)
    for body in (
        "GPRMC,120000.00,A,5759.0,N,01144.3,E,5.2,28.27,010526,,,A",
        "IIMTW,16.8,C",
        "IIMTW,16.9,C",
    )
]


def test_a_log_without_wind_is_refused_as_such() -> None:
    with pytest.raises(InputError, match="not a log of a known format") as caught:
        read("\n".join(WITHOUT_WIND))
    assert "hold no sentence of wind" in str(caught.value.fix)
    assert "there are 2 MTW, 1 RMC" in str(caught.value.fix)


@pytest.mark.parametrize(("reader", "before"), [(Nmea, ""), (StampedNmea, "2026-05-01T12:00:00Z,")])
def test_where_winds_may_come_later_the_format_can_be_named(
    reader: type[Nmea | StampedNmea], before: str
) -> None:
    guess = reader().recognise(Head(lines=tuple(before + text for text in WITHOUT_WIND)))
    assert guess is not None
    assert str(guess.fix).endswith(f"--as {reader.name}")
