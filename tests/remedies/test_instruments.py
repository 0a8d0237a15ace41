"""Remedies of instruments' lines, loggers' tables and networks of vessels: what they name is typed,
the log is read."""

from __future__ import annotations

import re
import shlex
from functools import reduce
from operator import xor

import pytest

from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.test_format_exports import EDDYPRO, eddypro
from tests.remedies.cases import OR, Case, heal
from tests.remedies.test_winds import PLAIN, PLAIN_NAKED, RECIPE, STREAM, TIMELESS, ZONED, mwv, rows
from tests.remedies.user import User

S = range(40)
ISO = "2026-05-01T12:{m}:{s}Z"


def stamped(*lines: str) -> str:
    """Each line after a stamp, one a second, ten times over."""
    return "".join(
        f"2026-05-01T12:{k // 60:02d}:{k % 60:02d}Z {lines[k % len(lines)]}\n" for k in S
    )


def network(*sources: int, reference: str = "fa", speed_over_ground: str = "") -> str:
    """Wind of each device of an NMEA 2000 network, of which the last byte says what it refers
    to."""
    text = ""
    for k in S:
        stamp = f"2026-05-01T12:00:{k:02d}.000Z"
        if speed_over_ground:
            text += f"{stamp},2,129026,1,255,8,00,fc,5c,3d,{speed_over_ground},ff,ff\n"
        for source in sources:
            text += f"{stamp},2,130306,{source},255,8,00,{0xF4 + k % 7:02x},01,5c,3d,{reference},ff,ff\n"
    return text


def vtg(*, knots: float) -> str:
    """The course and speed over ground of a stream whose wind is apparent."""
    return "".join(
        mwv(k) + sentence(f"GPVTG,90.0,T,,M,{knots:.1f},N,{knots * 1.852:.1f},K,A") + "\n"
        for k in S
    )


def framed(body: str) -> str:
    """A telegram of Thies with its checksum."""
    return f"\x02{body}*{reduce(xor, body.encode()):02X}\x03"


def by(form: str) -> str:
    """A recipe of a table whose stamps have this format and no zone."""
    return RECIPE.replace('zone = "+01:00"\n', "").replace('"iso"', f'"{form}"')


POLAR = [f"\x02Q,{229 + k},00{2 + k}.74,M,00,\x03" for k in range(6)]
UNSTAMPED = "\n".join(POLAR * 6) + "\n"
COMPONENTS = stamped(*(f"M:x = {300 + k} y = {20 + k} z = 0 t = 2186" for k in range(7)))
THEORETICAL = "--columns time,theoretical_wind_speed[m/s],theoretical_wind_direction[deg]"
THIES = stamped(*(framed(f"0{2 + k}.4 {213 + k} +21.5 00") for k in range(5)))

HOBO = rows(
    'Plot Title: mast\n"#","Date Time, GMT+00:00","Wind Speed, m/s (LGR S/N: 1, SEN S/N: 2)"\n',
    "{k},05/13/26 12:{m}:{s},{v}",
)
TOA5 = rows(
    '"TOA5","s","CR1000"\n"TIMESTAMP","RECORD","WS_Avg","WindDir_Avg"\n"TS","RN","m/s","degrees"\n"","","Avg","Avg"\n',
    '"2026-05-01 12:{m}:{s}",{k},{v},{d}',
)
TWO_SPEEDS = rows(
    '"TOA5","s","CR1000"\n"TIMESTAMP","RECORD","WS_Avg","WS2_Avg"\n"TS","RN","m/s","m/s"\n"","","Smp","Smp"\n',
    '"2026-05-01 12:{m}:{s}",{k},{v},{v}5',
)
SYSLOG = "".join(f"Feb 28 12:00:{k:02d} {POLAR[k % 6]}\n" for k in S)
LEAP = "".join(f"Feb 29 12:00:{k:02d} {POLAR[k % 6]}\n" for k in S)
OF_DAY = "".join(f"12:00:{k:02d} {POLAR[k % 6]}\n" for k in S)
ELAPSED = "time,wind_speed\n" + "".join(f"{k},{4 + k % 7 / 10}\n" for k in S)
STRETCHES = "time,wind_speed\n" + "".join(f"{k % 20},{4 + k % 7 / 10}\n" for k in S)
WEATHERLINK = "\t\t\tWind\tWind\nDate\tTime\tTemp\tSpeed\tDir\n" + "".join(
    f"{25 + k}/05/26\t10:30a\t20.1\t{1.6 * k:.1f}\tNNE\n" for k in range(1, 4)
)
SITE_RECIPE = (
    RECIPE.replace('wind_speed"\nunit', 'wind_speed (m/s)"\nunit').replace('zone = "+01:00"\n', "")
    + '[rows]\ncolumn = "site"\nvalue = "{0}"\n'
)
FLUX = "TIMESTAMP_START,TIMESTAMP_END,WS_F_QC,WS_ALT\n" + "".join(
    f"2026050112{30 * (k % 2):02d},2026050112{30 + k},0,2.{5 + k}\n" for k in range(4)
)

CASES = [
    Case(
        "canboat.py",
        "choose one by its address",
        "ingest a.log --platform fixed",
        ("ingest a.log --platform fixed --talker 36",),
        files={"a.log": network(36, 37)},
    ),
    Case(
        "samples/platform.py",
        "leave out --azimuth",
        "ingest a.log --platform fixed --azimuth 30",
        ("ingest a.log --platform fixed",),
        files={"a.log": network(36, reference="f8")},
    ),
    Case(
        "samples/platform.py",
        "leave out --platform",
        "ingest a.nmea --platform fixed",
        ("ingest a.nmea",),
        files={"a.nmea": vtg(knots=8)},
    ),
    Case(
        "samples/platform.py",
        "if it is wind over groun",
        f"ingest a.csv {THEORETICAL}",
        (f"ingest a.csv {THEORETICAL} --platform corrected",),
        files={"a.csv": ZONED},
    ),
    Case(
        "samples/platform.py",
        "if the sensor is on a ma",
        "ingest a.csv --columns time,apparent_wind_speed[m/s],apparent_wind_direction[deg]",
        (
            (
                "ingest a.csv --columns time,apparent_wind_speed[m/s],apparent_wind_direction[deg] "
                "--platform fixed"
            ),
        ),
        files={"a.csv": ZONED},
    ),
    Case(
        "samples/platform.py",
        "if the log's wind is ove",
        "ingest a.csv --columns time,wind_speed[m/s],platform_speed[m/s]",
        ("ingest a.csv --columns time,wind_speed[m/s],platform_speed[m/s] --platform corrected",),
        files={"a.csv": rows("time,wind,over ground\n", ISO + ",{v},3.5")},
    ),
    Case(
        "samples/platform.py",
        "rm: --platform corrected",
        "ingest a.csv --columns time,wind_speed[m/s],platform_speed[m/s] --platform fixed",
        (
            "ingest a.csv --columns time,wind_speed[m/s],platform_speed[m/s] --platform moving",
            OR,
            "ingest a.csv --columns time,wind_speed[m/s],platform_speed[m/s] --platform corrected",
        ),
        files={"a.csv": rows("time,wind,over ground\n", ISO + ",{v},3.5")},
    ),
    Case(
        "instants/zones.py",
        ", unless the file is kno",
        "ingest a.csv --zone UTC",
        ("ingest a.csv --zone -05:00",),
        files={"a.csv": HOBO.replace("GMT+00:00", "GMT-05:00")},
    ),
    Case(
        "formats/recipe_headings.py",
        "give the one that was se",
        "ingest a.txt --zone UTC",
        ("ingest a.txt --zone UTC --unit km/h",),
        files={"a.txt": WEATHERLINK},
    ),
    Case(
        "serial_lines.py",
        "give the one that the in",
        "ingest a.log",
        ("ingest a.log --unit m/s", OR, "ingest a.log --unit kn"),
        files={"a.log": THIES},
    ),
    Case(
        "serial_lines.py",
        "if it does not, give the",
        "ingest a.log",
        ("ingest a.log --azimuth 30",),
        files={"a.log": stamped(*POLAR)},
    ),
    Case(
        "serial_lines.py",
        "leave out --azimuth, or",
        "ingest a.log --azimuth 30",
        ("ingest a.log",),
        files={"a.log": COMPONENTS},
    ),
    Case(
        "makers.py",
        "leave out --unit",
        "ingest a.log --unit kn",
        ("ingest a.log",),
        files={"a.log": stamped(*(framed(f"00{2 + k}.4 {213 + k} +21.5 M 00") for k in range(5)))},
    ),
    Case(
        "serial_lines.py",
        "log each line after the",
        "ingest a.log",
        ("ingest a.log --start 2026-05-01T12:00:00Z --rate 4",),
        files={"a.log": UNSTAMPED},
    ),
    Case(
        "instants/log_clock.py",
        "to let those rows end wh",
        "ingest a.csv",
        ("ingest a.csv --clock last",),
        files={
            "a.csv": rows("time,wind_speed (m/s)\n", "2000-01-01T00:{m}:{s}Z,{v}", 20)
            + rows("", ISO + ",{v}", 200),
        },
    ),
    Case(
        "instants/dates.py",
        "give --date-order",
        "ingest a.csv",
        ("ingest a.csv --date-order dmy", OR, "ingest a.csv --date-order mdy"),
        files={"a.csv": HOBO.replace("05/13/26", "05/06/2026")},
    ),
    Case(
        "instants/dates.py",
        "leave out --date-order,",
        "ingest a.csv --date-order dmy",
        ("ingest a.csv",),
        files={"a.csv": HOBO},
    ),
    Case(
        "instants/dates.py",
        "t row: --date 2026-05-01",
        "ingest a.csv --sensor FILE.toml --zone UTC",
        ("ingest a.csv --sensor FILE.toml --zone UTC --date 2026-05-01",),
        files={"a.csv": rows("time,wind_speed\n", "12:{m}:{s},{v}"), "FILE.toml": by("%H:%M:%S")},
    ),
    Case(
        "instants/dates.py",
        "h its year: --date YYYY-",
        "ingest a.csv --sensor FILE.toml --zone UTC",
        ("ingest a.csv --sensor FILE.toml --zone UTC --date 2026-05-01",),
        files={
            "a.csv": rows("time,wind_speed\n", "05-01 12:{m}:{s},{v}"),
            "FILE.toml": by("%m-%d %H:%M:%S"),
        },
    ),
    Case(
        "instants/dates.py",
        "give its day with its ye",
        "ingest a.csv --sensor FILE.toml --zone UTC --date 2026-05-02",
        ("ingest a.csv --sensor FILE.toml --zone UTC --date 2026-05-01",),
        files={
            "a.csv": rows("time,wind_speed\n", "05-01 12:{m}:{s},{v}"),
            "FILE.toml": by("%m-%d %H:%M:%S"),
        },
    ),
    Case(
        "instants/dates.py",
        "give --date with the yea",
        "ingest a.csv --sensor FILE.toml --zone UTC --date 2026-02-28",
        ("ingest a.csv --sensor FILE.toml --zone UTC --date 2024-02-29",),
        files={
            "a.csv": rows("time,wind_speed\n", "02-29 12:{m}:{s},{v}"),
            "FILE.toml": by("%m-%d %H:%M:%S"),
        },
    ),
    Case(
        "instants/dates.py",
        "give the instant of the",
        "ingest a.csv --sensor FILE.toml",
        ("ingest a.csv --sensor FILE.toml --start 2026-05-01T12:00:00+02:00",),
        files={"a.csv": ELAPSED, "FILE.toml": by("elapsed-s")},
    ),
    Case(
        "anemometer/anemometer_log.py",
        "give the day of the firs",
        "ingest a.log",
        ("ingest a.log --date 2026-05-01 --zone UTC",),
        files={"a.log": OF_DAY},
    ),
    Case(
        "anemometer/anemometer_log.py",
        "give the day of the firs",
        "ingest a.log",
        ("ingest a.log --date 2026-02-28 --zone UTC",),
        files={"a.log": SYSLOG},
    ),
    Case(
        "untimed.py",
        "give --date with the yea",
        "ingest a.log --date 2026-02-28 --zone UTC",
        ("ingest a.log --date 2024-02-29 --zone UTC",),
        files={"a.log": LEAP},
    ),
    Case(
        "untimed.py",
        "give its day with its ye",
        "ingest a.log --date 2026-05-01 --zone UTC",
        ("ingest a.log --date 2026-02-28 --zone UTC",),
        files={"a.log": SYSLOG},
    ),
    Case(
        "samples/zero.py",
        "give the reading in calm",
        "ingest a.csv --zero-offset estimate",
        ("ingest a.csv --zero-offset 0.1", OR, "ingest a.csv --zero-offset report"),
        files={"a.csv": ZONED},
    ),
    Case(
        "table/delimited.py",
        "describe it by a recipe:",
        "ingest a.csv --as delimited",
        ("ingest a.csv --sensor FILE.toml",),
        files={
            "a.csv": "begin\n" + "no table\n" * 600 + PLAIN_NAKED,
            "FILE.toml": RECIPE.replace("header = 1", "preamble = 601\nheader = 1"),
        },
    ),
    Case(
        "marks.py",
        "leave out --date",
        "ingest a.nmea --platform fixed --date 2026-05-02",
        ("ingest a.nmea --platform fixed",),
        files={"a.nmea": STREAM},
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


DRAFTED = [
    Case(
        "toa5.py",
        "have the program average",
        "ingest a.dat --zone UTC",
        ("ingest a.dat --zone UTC --as delimited --columns '1=time,3=wind_speed[m/s]'",),
        files={"a.dat": TOA5},
    ),
    Case(
        "formats/described.py",
        "; or let its columns be",
        "ingest a.csv --zone UTC",
        ("ingest a.csv --zone UTC --as delimited --columns '2=time,4=wind_speed[m/s]'",),
        files={"a.csv": FLUX},
    ),
    Case(
        "formats/described.py",
        "let its columns be drafted, and conf",
        "ingest a.dat --zone UTC",
        ("ingest a.dat --zone UTC --as delimited --columns '1=time,3=wind_speed[m/s]'",),
        files={
            "a.dat": TOA5.replace("WS_Avg", "Cups_Avg")
            .replace("WindDir_Avg", "Vane_Avg")
            .replace("degrees", "deg")
        },
    ),
    Case(
        "formats/described.py",
        "to read the others, too,",
        "ingest a.dat --zone UTC",
        (
            (
                "ingest a.dat --zone UTC --as delimited --columns '1=time,4=wind_speed[m/s]' --name "
                "other"
            ),
        ),
        files={"a.dat": TWO_SPEEDS},
        untried="--unit",
    ),
]


@pytest.mark.parametrize("case", DRAFTED, ids=str)
def test_a_table_that_is_drafted_by_a_remedy_is_read_once_it_is_confirmed(
    case: Case, user: User
) -> None:
    for name, text in case.files.items():
        (user.folder / name).write_text(text)
    meet = user.meets
    meet(case.module, case.words, *shlex.split(case.command))
    user.leaves(case.untried.split())
    (command,) = map(shlex.split, case.then)
    ended = user.follows(*command, code=3, shows="repeat the command with --accept")
    user.succeeds(*command, "--accept", re.findall(r"--accept (\w+)", ended.err)[0])


def test_units_that_lack_a_cell_are_read_by_the_columns_that_are_named(user: User) -> None:
    (user.folder / "a.csv").write_text(
        eddypro([unit for name, unit in EDDYPRO.items() if name != "DOY"])
    )
    fix = user.meets(
        "formats/recipe_headings.py", "mend the line of units;", "ingest", "a.csv", "--zone", "UTC"
    )
    (columns,) = re.findall(r"--columns '([^']*)'", fix)
    command = ("ingest", "a.csv", "--zone", "UTC", "--columns", columns, "--expect", "coarse")
    ended = user.follows(*command, code=3, shows="--accept")
    user.succeeds(*command, "--accept", re.findall(r"--accept (\w+)", ended.err)[0])


def test_a_component_is_no_speed_and_is_named_with_the_other(user: User) -> None:
    lines = (f"2026-05-01T12:00:{k:02d}Z,{-2 - k % 7 / 10:.1f},{1 + k % 5 / 10:.1f}\n" for k in S)
    (user.folder / "a.csv").write_text("time,wind_speed,v\n" + "".join(lines))
    fix = user.meets(
        "samples/rules.py", "name both components and", "ingest", "a.csv", "--sensor", "generic-csv"
    )
    assert "wind_x[m/s] and wind_y[m/s]" in fix
    user.follows("ingest", "a.csv", "--columns", "time,wind_x[m/s],wind_y[m/s]", "--azimuth", 270)


@pytest.mark.parametrize("sites", [("north", "south"), ("north",)])
def test_a_site_that_a_recipe_names_otherwise_than_the_file_is_named_as_the_file_writes_it(
    user: User, sites: tuple[str, ...]
) -> None:
    lines = "\n".join(ISO + f",{site},{{v}}" for site in sites)
    (user.folder / "a.csv").write_text(rows("time,site,wind_speed (m/s)\n", lines))
    (user.folder / "FILE.toml").write_text(SITE_RECIPE.format("North"))
    fix = user.types("ingest", "a.csv", "--sensor", "FILE.toml").err.partition("fix: ")[2]
    assert re.findall("'(.*?)'", fix) == list(sites)
    (user.folder / "FILE.toml").write_text(SITE_RECIPE.format("north"))
    user.succeeds("ingest", "a.csv", "--sensor", "FILE.toml", shows="samples +40,")


def test_of_many_sites_the_first_are_named(user: User) -> None:
    lines = "".join(
        f"2026-05-01T12:00:{k:02d}Z,{letter},5.0\n" for letter in "abcdefghijklmnop" for k in S
    )
    (user.folder / "a.csv").write_text("time,site,wind_speed (m/s)\n" + lines)
    (user.folder / "FILE.toml").write_text(SITE_RECIPE.format("A"))
    err = user.types("ingest", "a.csv", "--sensor", "FILE.toml").err
    assert "'a' or 'b'" in err
    assert "'l', or one of 4 more" in err


def test_a_count_that_starts_again_is_read_as_a_file_of_each_stretch(user: User) -> None:
    (user.folder / "FILE.toml").write_text(by("elapsed-s"))
    (user.folder / "a.csv").write_text(STRETCHES)
    start = ("--sensor", "FILE.toml", "--start")
    user.meets(
        "instants/dates.py",
        "make a file of each stre",
        "ingest",
        "a.csv",
        *start,
        "2026-05-01T12:00:00Z",
    )
    head, *lines = STRETCHES.splitlines(keepends=True)
    for number in range(2):
        name = f"{number}.csv"
        (user.folder / name).write_text(head + "".join(lines[20 * number :][:20]))
        user.follows("ingest", name, *start, f"2026-05-01T1{number}:00:00Z")


STILL = sentence("GPZDA,120000.00,01,05,2026,00,00") + "\n"
STREAMS = {
    "a clock that stands still": STILL.join(mwv(k, time=False) for k in (*S, 0)),
    "a receiver without a fix": (sentence("GPRMC,,V,,,,,,,,,,N") + "\n").join([TIMELESS] * 3),
    "no sentence with a time": TIMELESS,
    "one time": STILL + mwv(1, time=False) * 3,
}
"""Streams that do not say when each sentence came."""


@pytest.mark.parametrize("name", STREAMS)
def test_a_stream_without_times_that_go_on_is_read_at_the_rate_at_which_it_came(
    user: User, name: str
) -> None:
    (user.folder / "a.nmea").write_text(STREAMS[name])
    fix = user.meets(
        "marks.py", "if its wind came at a steady rate", "ingest", "a.nmea", "--platform", "fixed"
    )
    assert "column" not in fix
    user.again("--start", "2026-05-01T12:00:00Z", "--rate", 1, shows="median rate 1 Hz")


def test_a_stream_whose_clock_goes_on_later_keeps_its_times(user: User) -> None:
    still = STILL.join(mwv(k, time=False) for k in range(1100))
    (user.folder / "a.nmea").write_text(still + "".join(mwv(k) for k in S))
    steady = ("--start", "2026-05-01T12:00:00Z", "--rate", 1)
    ended = user.types("ingest", "a.nmea", "--platform", "fixed", *steady)
    assert ended.code == 2
    assert "--rate is not used" in ended.err


def test_a_log_that_is_hours_off_comes_in_anew_by_the_zone_of_the_other(user: User) -> None:
    line = "2026-05-01T{h:02d}:{m:02d}:00,{v:.1f}\n"
    wind = [4 + 3 * ((k * k + 7 * k) % 11) / 11 for k in range(1200)]
    text = "".join(line.format(h=k // 60, m=k % 60, v=v) for k, v in enumerate(wind))
    for name in ("a", "b"):
        (user.folder / f"{name}.csv").write_text(
            "time,wind_speed\n" + text.replace("4.0\n", f"4.0{name == 'b':d}\n")
        )
    user.succeeds("ingest", "a.csv", "--sensor", "generic-csv", "--zone", "UTC")
    command = ("ingest", "b.csv", "--sensor", "generic-csv", "--zone")
    user.meets("samples/neighbours.py", "check --zone of both log", *command, "+02:00")
    user.succeeds("withdraw", "b", "-m", "the zone")
    user.follows(*command, "UTC")


def test_letters_of_another_encoding_are_read_by_the_one_that_is_named(user: User) -> None:
    (user.folder / "a.csv").write_bytes(
        PLAIN.replace("Z,4.0", "Z,4.0,25 \N{DEGREE SIGN}C").encode("cp1252")
    )
    user.meets(
        "text/text_file.py", "name the encoding, e.g.", "ingest", "a.csv", "--sensor", "generic-csv"
    )
    user.again("--encoding", "cp1252")
