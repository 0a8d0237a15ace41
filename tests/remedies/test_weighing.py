"""Remedies of `flagdata calibrate` that weighs a cloth: simulations are a known function, films are
read as they show.

What a table or a film shows comes from `tests.measure.cloth.calibration`; the messages and what is
typed are the program's.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.timebase import NANOSECONDS
from measure.cloth import Design
from measure.cloth import cloth_calibration as calibrate
from tests.measure.cloth.calibration.conftest import cheap as cheap
from tests.measure.cloth.calibration.conftest import known, readings
from tests.remedies.cases import Case, heal
from tests.remedies.user import User

SIZED = "--flag-size 1.5x1.0 --azimuth 70±7"
WEIGHED = "area weight"
START = 1_777_629_600 * NANOSECONDS
"""When the scene's films begin."""


def shown(speed: FloatArray, *, azimuth: float = 70.0) -> FloatArray:
    """(window, 3) what windows in these winds show of one cloth."""
    values = {"area_weight": 0.2, "gain": 1.0, "damping": 0.01, "azimuth": math.radians(azimuth)}
    return readings({name: np.array([value]) for name, value in values.items()}, speed, seed=3)[
        0, :, :3
    ]


def gusts(windows: int = 48, *, swing: float = 1.5) -> FloatArray:
    return 5.0 + swing * np.sin(np.arange(windows) / 1.7)


def table(heading: str, *columns: Sequence[float] | FloatArray, spacing: float = 2.5) -> str:
    """A table of windows, whose first column is their time."""
    count = len(columns[0])
    rows = np.column_stack([spacing * np.arange(count), *columns]).tolist()
    return "\n".join([heading, *(",".join(map(str, row)) for row in rows), ""])


def windy(speed: FloatArray) -> str:
    return table("time,wind,droop,extension,middle-speed", speed, shown(speed))


GUSTY, STEADY = windy(gusts()), windy(gusts(swing=0.0))
WINDLESS = table("time,area", np.linspace(0.9, 0.8, 30))
"""Beside it a log is needed, and nothing in it follows the wind."""
DROOPING = table("time,droop,extension,middle-speed", shown(gusts(30)))
JOINED = f"calibrate t.csv {SIZED} --log mast --clock-offset 1777629605±0.1"
"""The table's clock begins at 0, the log at the scene's time."""
GAP = "time,wind_speed (m/s),wind_direction (deg)\n" + "".join(
    f"2026-05-01T10:0{k // 60}:{k % 60:02d}Z,{5 + k % 10 / 10},{200 + k % 9}\n"
    for k in range(180)
    if not 75 < k < 100
)
"""A log of three minutes that was interrupted."""
CASES = [
    Case(
        "cloth/table_clock.py",
        "name a wind artifact: flagdata ls",
        f"calibrate t.csv {SIZED} --log first",
        ("ls --kind wind",),
        files={"t.csv": DROOPING},
        shows="mast",
    ),
    Case(
        "cloth/table_clock.py",
        "state the offset of the clocks",
        f"calibrate t.csv {SIZED} --log mast",
        (JOINED,),
        files={"t.csv": WINDLESS},
        shows="simulating flags",
        code=3,
    ),
    Case(
        "cloth/table_clock.py",
        "or state what is added to the table's clock",
        f"calibrate t.csv {SIZED} --log mast",
        (JOINED,),
        files={"t.csv": DROOPING},
        shows=WEIGHED,
    ),
    Case(
        "cloth/flag_recordings.py",
        "name the log: --log ARTIFACT --lake LAKE",
        f"calibrate t.csv {SIZED} --clock-offset 1777629605±0.1",
        (f"{JOINED} --lake lake",),
        files={"t.csv": DROOPING},
        shows=WEIGHED,
    ),
    Case(
        "cloth/tables_of_observables.py",
        "give the wind in the table or as a log",
        f"calibrate t.csv {SIZED}",
        (JOINED,),
        files={"t.csv": DROOPING},
        shows=WEIGHED,
    ),
    Case(
        "cloth/flag_recordings.py",
        "leave both out; flagdata observe takes them",
        f"calibrate t.csv {SIZED} --crop 0,0,9,9",
        ("observe --help", f"calibrate t.csv {SIZED}"),
        files={"t.csv": GUSTY},
        shows="--crop",
    ),
    Case(
        "drape/drape_answer.py",
        "or leave --area-weight out",
        "calibrate t.csv --area-weight 0.2",
        (f"calibrate t.csv {SIZED}",),
        files={"t.csv": GUSTY},
        shows=WEIGHED,
    ),
    Case(
        "commands/calibrate_recordings.py",
        "or give --only weight",
        f"calibrate t.csv {SIZED} --name x",
        (f"calibrate t.csv {SIZED} --only weight",),
        files={"t.csv": GUSTY},
        shows=WEIGHED,
    ),
    Case(
        "cloth/observed_recording.py",
        "add recordings in other winds",
        f"calibrate t.csv {SIZED}",
        (f"calibrate t.csv u.csv {SIZED}",),
        files={"t.csv": STEADY, "u.csv": windy(gusts() * 2)},
        shows=WEIGHED,
    ),
    Case(
        "cloth/blown_wind.py",
        "choose a part of the fil",
        f"calibrate long.csv {SIZED} --log mast --clock-offset 1777629605±0.1",
        (
            (
                f"calibrate long.csv {SIZED} --log mast --clock-offset 1777629605±0.1 --start 0s --end "
                "100s"
            ),
        ),
        files={"long.csv": table("time,droop,extension,middle-speed", shown(gusts(60)))},
        shows=WEIGHED,
    ),
    Case(
        "cloth/blown_wind.py",
        "choose a part without ga",
        f"calibrate t.csv {SIZED} --log gap --clock-offset 1777629605±0.1",
        (f"calibrate t.csv {SIZED} --log gap --clock-offset 1777629605±0.1 --start 0s --end 60s",),
        files={
            "t.csv": table("time,droop,extension,middle-speed", shown(gusts(40))),
            "gap.csv": GAP,
        },
        before=("ingest gap.csv",),
        shows=WEIGHED,
    ),
    Case(
        "cloth/observed_recording.py",
        "choose others with --start and --end",
        f"calibrate t.csv {SIZED}",
        (f"calibrate t.csv {SIZED} --start 60s --end 150s",),
        files={"t.csv": windy(gusts(60))},
        shows=WEIGHED,
    ),
]


@pytest.mark.usefixtures("cheap")
@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


def test_a_log_of_a_table_is_in_a_lake(user: User, monkeypatch: pytest.MonkeyPatch) -> None:
    (user.folder / "t.csv").write_text(DROOPING)
    monkeypatch.delenv("FLAGDATA_LAKE")
    user.meets(
        "cloth/flag_recordings.py", "name the lake that it was ingested into", *JOINED.split()
    )
    user.again("--lake", "lake")


@pytest.mark.usefixtures("cheap")
def test_the_weight_that_was_found_is_given_to_a_measurement(user: User) -> None:
    (user.folder / "t.csv").write_text(GUSTY)
    said = user.meets(
        "commands/calibrate.py", "measure: --area-weight", "calibrate", "t.csv", *SIZED.split()
    )
    weight = shlex.split(said.partition("--area-weight ")[2].splitlines()[0])[0]
    user.follows(
        "measure",
        "second.mp4",
        "--area-weight",
        weight,
        code=1,
        shows="s of film, a measurement takes",
    )


def simulated(patch: pytest.MonkeyPatch, shows: Any) -> None:
    """Let simulations show `known`, changed by a function of the design and of what they show."""

    def changed(design: Design, *, folder: Any, workers: int, advance: object) -> FloatArray:
        return shows(design, known(design, folder=folder, workers=workers, advance=advance))

    patch.setattr(calibrate, "simulated_values", changed)


@pytest.mark.usefixtures("cheap")
def test_flags_that_are_simulated_otherwise_do_not_show_what_the_film_shows(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a size that is not the film's most flags hang down."""

    def shows(design: Design, every: FloatArray) -> FloatArray:
        rare = design.flag.length > 2
        return np.where(
            (np.arange(len(every)) % 12 < (9 if rare else 0))[:, None, None], np.nan, every
        )

    simulated(monkeypatch, shows)
    (user.folder / "t.csv").write_text(GUSTY)
    command = ("calibrate", "t.csv", "--flag-size", "2.5x1.0", "--azimuth", "70±7")
    user.meets("cloth/emulator.py", "check --flag-size, --attachment and --azimuth", *command)
    user.follows("calibrate", "t.csv", "--flag-size", "1.5x1.0", "--azimuth", "70±7", shows=WEIGHED)
    user.leaves(["--attachment", "--azimuth", "--simulations"])


@pytest.mark.usefixtures("cheap")
def test_windows_with_more_wind_show_the_cloth(user: User, monkeypatch: pytest.MonkeyPatch) -> None:
    """In less than 3 m/s all flags hang alike."""
    noise = np.random.default_rng(1)

    def shows(design: Design, every: FloatArray) -> FloatArray:
        return every if design.log.speed.mean() > 3 else noise.standard_normal(every.shape)

    simulated(monkeypatch, shows)
    (user.folder / "t.csv").write_text(windy(np.concatenate([gusts(24) - 3.4, gusts(24)])))
    command = ("calibrate", "t.csv", *SIZED.split())
    user.meets("cloth/emulator.py", "or windows with more wind", *command, "--end", "60s")
    user.leaves(["--simulations"])
    user.succeeds(*command, "--start", "60s", shows=WEIGHED)


@pytest.mark.usefixtures("cheap")
def test_more_simulations_widen_intervals_that_are_too_narrow(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is found of simulations left out stands in: few are held of 64."""
    plain = calibrate.check_coverage

    def checked(made: Any, options: calibrate.Options) -> calibrate.Check:
        found = plain(made, options)
        return calibrate.Check(
            count=found.count,
            held=found.count * (options.simulations > 100),
            median_error=found.median_error,
        )

    monkeypatch.setattr(calibrate, "check_coverage", checked)
    (user.folder / "t.csv").write_text(GUSTY)
    user.meets(
        "cloth/cloth_calibration.py",
        "give more simulations with --simulations",
        "calibrate",
        "t.csv",
        *SIZED.split(),
        "--simulations",
        64,
    )
    user.again("--simulations", 128)


@pytest.mark.usefixtures("cheap")
def test_a_flag_from_another_side_looks_like_no_simulated_one(user: User) -> None:
    (user.folder / "t.csv").write_text(GUSTY)
    command = ("calibrate", "t.csv", "--flag-size", "1.5x1.0")
    user.meets(
        "cloth/cloth_calibration.py",
        "look at the readings with flagdata observe",
        *command,
        "--azimuth",
        "160±2",
    )
    user.follows(*command, "--azimuth", "70±7", shows=WEIGHED)
    user.leaves(
        [
            "observe",
            "--picture",
            "--flag-size",
            "--attachment",
            "--elevation",
            "--distance",
            "close-loop",
        ]
    )
