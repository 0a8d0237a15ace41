"""Remedies of anemometer logs: options that they name are given as they say, and the log is
read."""

from __future__ import annotations

import shlex
import textwrap

import pytest

from tests.flagdata.ingest.anemometer.cases import sentence
from tests.remedies.cases import OR, Case, heal
from tests.remedies.user import User


def rows(head: str, line: str, count: int = 40) -> str:
    """A text of lines in which {s} is the second of a minute and {v} a speed."""
    body = "".join(
        line.format(
            s=f"{k % 60:02d}", m=f"{k // 60:02d}", v=f"{4 + k % 7 / 10:.1f}", d=200 + k % 5, k=k
        )
        + "\n"
        for k in range(count)
    )
    return head + body


ISO = "2026-05-01T12:{m}:{s}"
ZONED = rows("time,wind_speed (m/s),wind_direction (deg)\n", ISO + "Z,{v},{d}")
NAKED = rows("time,wind_speed (m/s)\n", ISO + ",{v}")
UNITLESS = rows("time,wind_speed\n", ISO + "Z,{v}")
CLOCK = rows("time,wind_speed (m/s)\n", "12:{m}:{s},{v}")
UNTIMED = rows("wind_speed (m/s)\n", "{v}")
COMPONENTS = rows("time,u (m/s),v (m/s)\n", ISO + "Z,{v},1.0")
NUMBERS = rows("time,wind_speed (m/s)\n", "5/6/2026 12:{m}:{s},{v}")
PLAIN = rows("time,wind_speed\n", ISO + "Z,{v}")
PLAIN_NAKED = rows("time,wind_speed\n", ISO + ",{v}")
"""As the recipe generic-csv has it."""
SPRING = rows("time,wind_speed\n", "2026-03-29T02:{m}:{s},{v}", 150)
BACK = rows("time,wind_speed\n", ISO + "Z,{v}", 200) + rows("", "2026-05-01T12:01:{s}Z,{v}", 60)
TWO = rows("wind_speed (m/s),temp (C)\n", "{v},20.0")


RECIPE = """
name = "mine"
about = "A plain table"
source = "its owner"
[file]
delimiter = ","
header = 1
[time]
columns = ["time"]
format = "iso"
zone = "+01:00"
[channels.wind_speed]
column = "wind_speed"
unit = "m/s"
[sensor]
name = "mine"
"""
HOSTED = rows("laptop_time,raw_line\n", "2026-05-01T12:{m}:{s}.5Z,{v}")


def mwv(
    second: int, *, talker: str = "WI", date: bool = True, time: bool = True, reference: str = "R"
) -> str:
    lines = []
    if time:
        lines.append(
            sentence(f"GPZDA,1200{second:02d}.00,01,05,2026,00,00")
            if date
            else sentence(f"GPGGA,1200{second:02d}.00,5222.0,N,00452.0,E,1,08,1.0,1.0,M,46.0,M,,")
        )
    lines.append(
        sentence(f"{talker}MWV,{200 + second % 5}.0,{reference},{4 + second % 7 / 10:.1f},M,A")
    )
    return "\n".join(lines) + "\n"


STREAM = "".join(mwv(k) for k in range(40))
DAYLESS = "".join(mwv(k, date=False) for k in range(40))
TIMELESS = "".join(mwv(k, time=False) for k in range(40))
TALKERS = "".join(mwv(k) + mwv(k, talker="II", time=False) for k in range(40))

QUESTION = "\N{REPLACEMENT CHARACTER}--sensor FILE.toml"
"""After "answer by": the options of each question."""

CASES = [
    Case(
        "instants/zones.py",
        "name the zone of the logger's clock",
        "ingest a.csv --sensor generic-csv",
        (
            "ingest a.csv --sensor generic-csv --zone Europe/Amsterdam",
            OR,
            "ingest a.csv --sensor generic-csv --zone +01:00",
        ),
        files={"a.csv": PLAIN_NAKED},
    ),
    Case(
        "anemometer/anemometer_log.py",
        "or state it in a recipe, as [time] zone",
        "ingest a.csv --sensor generic-csv",
        ("ingest a.csv --sensor FILE.toml",),
        files={"a.csv": PLAIN_NAKED, "FILE.toml": RECIPE},
    ),
    Case(
        "instants/zones.py",
        "give the fixed offset that the logger's clock ran on",
        "ingest a.csv --sensor generic-csv --zone Europe/Amsterdam",
        (
            "ingest a.csv --sensor generic-csv --zone +01:00 --clock first",
            OR,
            "ingest a.csv --sensor generic-csv --zone +02:00 --clock last",
        ),
        files={"a.csv": SPRING},
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv",
        ("ingest a.csv --zone +01:00",),
        files={"a.csv": NAKED},
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv",
        ("ingest a.csv --unit km/h",),
        files={"a.csv": UNITLESS},
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv --zone UTC",
        (
            "ingest a.csv --zone UTC --date-order dmy",
            OR,
            "ingest a.csv --zone UTC --date-order mdy",
        ),
        files={"a.csv": NUMBERS},
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv",
        ("ingest a.csv --date 2026-05-01 --zone UTC",),
        files={"a.csv": CLOCK},
        code=3,
        shows="repeat the command with --accept",
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv",
        ("ingest a.csv --expect fixed",),
        files={
            "a.csv": ZONED.replace(",201", ",200")
            .replace(",202", ",200")
            .replace(",203", ",200")
            .replace(",204", ",200")
        },
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv --wind north",
        ("ingest a.csv --wind 'wind_speed (m/s)'",),
        files={"a.csv": ZONED},
        untried="--sensor",
    ),
    Case(
        "draft/questions.py",
        QUESTION,
        "ingest a.csv",
        ("ingest a.csv --columns 1=wind_speed[m/s] --start 2026-05-01T12:00:00Z --rate 1",),
        files={"a.csv": TWO},
        untried="--sensor",
    ),
    Case(
        "untimed.py",
        "give the instant of the first reading: --start",
        "ingest a.csv --rate 1 --columns wind_speed[m/s]",
        ("ingest a.csv --rate 1 --columns wind_speed[m/s] --start 2026-05-01T12:00:00+02:00",),
        files={"a.csv": UNTIMED},
    ),
    Case(
        "identify.py",
        "say what its columns are, in order",
        "ingest a.csv",
        ("ingest a.csv --columns wind_speed[m/s] --start 2026-05-01T12:00:00Z --rate 1",),
        files={"a.csv": UNTIMED},
        untried="--sensor",
    ),
    Case(
        "anemometer/log_reading.py",
        "leave out --azimuth; a turned vane",
        "ingest a.csv --azimuth 20",
        ("ingest a.csv",),
        files={"a.csv": ZONED},
    ),
    Case(
        "text/opening.py",
        "leave out --topic",
        "ingest a.csv --topic /x",
        ("ingest a.csv",),
        files={"a.csv": ZONED},
    ),
    Case(
        "text/text_file.py",
        "name the encoding it is in, e.g. --encoding cp1252",
        "ingest a.csv --encoding ascii --sensor generic-csv",
        ("ingest a.csv --encoding utf-8 --sensor generic-csv",),
        files={"a.csv": PLAIN.replace("Z,4.0", "Z,4.0,\N{DEGREE SIGN}")},
    ),
    Case(
        "marks.py",
        "give the date (UTC) of its first sentence",
        "ingest a.nmea",
        ("ingest a.nmea --date 2026-05-01",),
        files={"a.nmea": DAYLESS},
    ),
    Case(
        "marks.py",
        "if its wind came at a steady rate",
        "ingest a.nmea",
        ("ingest a.nmea --start 2026-05-01T12:00:00Z --rate 1",),
        files={"a.nmea": TIMELESS},
    ),
    Case(
        "nmea.py",
        "choose one, e.g. --talker",
        "ingest a.nmea",
        ("ingest a.nmea --talker WI",),
        files={"a.nmea": TALKERS},
    ),
    Case(
        "nmea.py",
        "give --clock first or --clock last",
        "ingest a.nmea --clock sort",
        ("ingest a.nmea --clock first", OR, "ingest a.nmea --clock last", OR, "ingest a.nmea"),
        files={"a.nmea": STREAM},
    ),
    Case(
        "samples/platform.py",
        "if the sensor is on a mast, give --platform fixed",
        "ingest a.nmea",
        ("ingest a.nmea --platform fixed",),
        files={"a.nmea": STREAM},
    ),
    Case(
        "samples/platform.py",
        "add --platform fixed, or leave it out",
        "ingest a.nmea --azimuth 30",
        ("ingest a.nmea --azimuth 30 --platform fixed", OR, "ingest a.nmea"),
        files={"a.nmea": STREAM},
    ),
    Case(
        "samples/platform.py",
        "say --platform moving: its wind is then apparent wind",
        "ingest a.nmea --platform corrected",
        ("ingest a.nmea --platform moving",),
        files={"a.nmea": STREAM},
    ),
    Case(
        "samples/zero.py",
        "leave out --zero-offset",
        "ingest a.nmea --zero-offset 0.1",
        ("ingest a.nmea",),
        files={"a.nmea": STREAM},
    ),
    Case(
        "samples/rules.py",
        "if calm air reads below zero, give --zero-offset",
        "ingest a.csv --sensor generic-csv",
        ("ingest a.csv --sensor generic-csv --zero-offset -0.3",),
        files={"a.csv": PLAIN.replace(",4.0", ",-0.3")},
    ),
    Case(
        "draft/doubts.py",
        "--clock corrects a clock that was set",
        "ingest a.csv",
        (
            "ingest a.csv --clock last",
            OR,
            "ingest a.csv --clock first",
            OR,
            "ingest a.csv --clock sort",
        ),
        files={"a.csv": BACK.replace("wind_speed", "wind_speed (m/s)")},
    ),
    Case(
        "ingest/artifacts_present.py",
        "or take the old one off with flagdata withdraw and ingest again",
        "ingest a.csv --name b",
        ("ingest a.csv", OR, "withdraw a -m name", "ingest a.csv --name b"),
        files={"a.csv": ZONED},
        before=("ingest a.csv",),
    ),
    Case(
        "ingest/artifacts_present.py",
        "or take the old one off with flagdata withdraw and ingest again",
        "ingest a.csv --session b",
        ("ingest a.csv", OR, "withdraw a -m name", "ingest a.csv --session b"),
        files={"a.csv": ZONED},
        before=("ingest a.csv",),
    ),
    Case(
        "table/delimited.py",
        "use --as host-stamped",
        "ingest a.log --as delimited --sensor serial-speed",
        ("ingest a.log --as host-stamped --sensor serial-speed",),
        files={"a.log": HOSTED},
    ),
    Case(
        "formats/host.py",
        "name one by --recipe",
        "ingest a.log --as host-stamped",
        ("ingest a.log --as host-stamped --recipe serial-speed",),
        files={"a.log": HOSTED},
    ),
    Case(
        "formats/host.py",
        "or use --as delimited",
        "ingest a.csv --as host-stamped --sensor generic-csv",
        ("ingest a.csv --as delimited --sensor generic-csv",),
        files={"a.csv": PLAIN},
    ),
    Case(
        "formats/toa5.py",
        "name another format by --as",
        "ingest a.csv --as toa5",
        ("ingest a.csv --as delimited",),
        files={"a.csv": ZONED},
    ),
    Case(
        "formats/stamped_nmea.py",
        "name another format by --as",
        "ingest a.nmea --as nmea-stamped",
        ("ingest a.nmea --as nmea",),
        files={"a.nmea": STREAM},
    ),
    Case(
        "formats/described.py",
        "export it again, or name another --as or --sensor",
        "ingest a.csv --as hobo",
        ("ingest a.csv --as delimited", OR, "ingest a.csv --sensor FILE.toml"),
        files={
            "a.csv": PLAIN.replace("wind_speed", "wind_speed[m/s]"),
            "FILE.toml": RECIPE.replace('"wind_speed"', '"wind_speed[m/s]"'),
        },
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


def test_a_draft_is_confirmed_by_the_hash_that_the_refusal_shows_or_described_by_the_recipe_that_sniff_prints(
    user: User,
) -> None:
    (user.folder / "a.csv").write_text(COMPONENTS)
    fix = user.meets(
        "anemometer/log_confirmation.py", "repeat the command with --accept", "ingest", "a.csv"
    )
    user.follows("ingest", "a.csv", *fix[fix.index("--accept") :].split(";")[0].split())
    ended = user.follows("ingest", "--sniff", "a.csv", shows="the recipe")
    lines = ended.out.partition("name = ")[1] + ended.out.partition("name = ")[2]
    (user.folder / "FILE.toml").write_text(textwrap.dedent("      " + lines))
    user.follows("ingest", "a.csv", "--sensor", "FILE.toml")


def test_the_direction_of_components_needs_an_azimuth(user: User) -> None:
    (user.folder / "a.csv").write_text(COMPONENTS)
    command = ("ingest", "a.csv", "--columns", "1=time,2=wind_x[m/s],3=wind_y[m/s]")
    user.meets("anemometer/log_reading.py", "give the sensor's azimuth for a direction", *command)
    user.again("--azimuth", 270)


def test_utf_16_without_a_mark_is_read_as_the_encoding_that_is_named(user: User) -> None:
    (user.folder / "a.csv").write_bytes(ZONED.encode("utf-16-le"))
    user.meets("text/text_file.py", "name it: --encoding utf-16-le", "ingest", "a.csv")
    user.again("--encoding", "utf-16-le")
    user.meets("text/text_file.py", "name it: --encoding utf-16-le", "ingest", "--sniff", "a.csv")
    user.again("--encoding", "utf-16-le")


def test_a_site_of_a_table_is_chosen_by_the_recipe_that_sniff_prints(user: User) -> None:
    line = ISO + "Z,north,{v}\n" + ISO + "Z,south,{v}"
    (user.folder / "a.csv").write_text(rows("time,site,wind_speed (m/s)\n", line))
    fix = user.meets(
        "draft/questions.py",
        "save the recipe that flagdata ingest --sniff prints",
        "ingest",
        "a.csv",
    )
    ended = user.follows("ingest", "--sniff", "a.csv")
    recipe = textwrap.dedent("      name = " + ended.out.partition("name = ")[2])
    chosen = fix.partition("and add\n")[2].partition("\nfor the one")[0]
    (user.folder / "FILE.toml").write_text(f"{recipe}\n{chosen}\n")
    user.follows("ingest", "a.csv", "--sensor", "FILE.toml")


def test_a_log_that_was_read_by_a_wrong_option_is_taken_off_by_the_id_that_is_named(
    user: User,
) -> None:
    (user.folder / "a.csv").write_text(NAKED)
    user.succeeds("ingest", "a.csv", "--zone", "+01:00")
    fix = user.meets("ingest/before.py", "flagdata withdraw", "ingest", "a.csv", "--zone", "+02:00")
    user.follows(*shlex.split(fix.partition("flagdata ")[2]))
    user.succeeds("show", "a")


def test_the_lines_of_no_format_are_looked_at_by_sniff(user: User) -> None:
    (user.folder / "a.csv").write_text(ZONED)
    user.meets(
        "serial_lines.py",
        "or look at the lines with flagdata ingest --sniff",
        "ingest",
        "a.csv",
        "--as",
        "metek",
    )
    user.follows("ingest", "--sniff", "a.csv", shows="anemometer: delimited")
    user.succeeds("ingest", "a.csv", "--as", "delimited")


def test_a_table_of_which_most_is_not_read_is_looked_at_by_sniff(user: User) -> None:
    recipe = RECIPE.replace('zone = "+01:00"', "").replace(
        'format = "iso"', 'format = "%d.%m.%Y %H:%M:%S"'
    )
    (user.folder / "FILE.toml").write_text(recipe)
    (user.folder / "a.csv").write_text(PLAIN + "01.05.2026 13:00:00,4.0\n")
    user.meets(
        "table/log_table.py",
        "look at it with flagdata ingest --sniff",
        "ingest",
        "a.csv",
        "--sensor",
        "FILE.toml",
        "--zone",
        "UTC",
    )
    user.follows("ingest", "--sniff", "a.csv", shows="time .* as ISO 8601")
