"""The physics from recordings, in Python: a film measured or observed, a cloth weighed, its model
judged.

The options of each call are stated in a class, from which the command of the same name inherits.
The packages behind
the calls are named by strings: flagdata imports none of those that rest on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.core.console import LocalPath
from flagdata.core.parts import attribute, call
from flagdata.errors import UsageError
from flagdata.verbs.option_types import DURATION, POSITIVE, SHARE, STATED
from flagdata.verbs.shared_options import (
    BOTH_STATED,
    FILM,
    FLAG,
    HOW,
    BesideLake,
    ByNulls,
    Drawn,
    FlagAndCamera,
    Keeping,
    NamedLake,
    OfCloth,
    OfFilm,
)
from flagdata.verbs.verb_options import argument, make_call, option, options

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from flagdata.answer.calibrated import Calibrated
    from flagdata.answer.closed import Closed
    from flagdata.answer.measured import Measured
    from flagdata.answer.proposed import Proposed
    from flagdata.core.stated import Stated
    from flagdata.ingest.films.film_array import Frames
    from flagdata.lake.catalog_rows import Rows
    from flagdata.lake.mesh_sequences import MeshSequence

OF_FLAG = "The flag"
BESIDE = "A log beside tables"
LENGTHS = "Length along the wind and height along the pole [m], as in 1.5x1.0"


@options
class Measuring(OfFilm, Drawn, BesideLake):
    """How a film is measured."""

    source: Path | str | Frames = argument(
        "A video file, a folder of images, `example:NAME`, frames as `frames` and `render` return "
        "them, or a "
        "recording, clip or camera of the lake by its name or id.",
        "SOURCE",
    )
    flag_size: tuple[float, float] | str | None = option(
        f"{LENGTHS}; of a hanging cloth its width and height. By default what an example states.",
        default=None,
        section=OF_FLAG,
        metavar="LxH",
    )
    area_weight: float | tuple[float, float] | str | Stated | None = option(
        "Area weight of the cloth [kg/m²]: 0.284, 0.284±0.01 (deviation) or 0.27:0.30.",
        default=None,
        section=OF_FLAG,
        type=STATED,
        metavar="VALUE",
    )
    material: str | None = option(
        "Cloth whose area weight is taken, a material of the catalog or a fabric that films of the "
        "lake declare; "
        "nothing else of it is used.",
        default=None,
        section=OF_FLAG,
        metavar="NAME",
    )
    wind: float | tuple[float, float] | str | Stated | None = option(
        "A wind from elsewhere [m/s], of a station or an app, as in 3±1: the answer is compared "
        "with it, and not "
        "changed by it.",
        default=None,
        section=HOW,
        type=STATED,
        metavar="M/S",
    )
    windows: float | None = option(
        "A wind series, one window every so often [s], as in 1.2s; by default windows follow each "
        "other.",
        default=None,
        section=HOW,
        was=("--window", "--step"),
        type=DURATION,
        metavar="TIME",
    )
    model: str | None = option(
        "Network that measures, or reading model of flagdata calibrate; by default flow-outdoor, "
        "of flags.",
        default=None,
        section=HOW,
        metavar="NAME|FOLDER|ID",
    )
    false_alarm: float = option(
        "Share of familiar films that the gate may refuse.", default=0.05, section=HOW, type=SHARE
    )
    anyway: bool = option(
        "Show, marked, what the model says of a film that the gate refuses, if anything moves in "
        "it.",
        default=False,
        section=HOW,
    )


@make_call(Measuring)
def measure(chosen: Measuring) -> Measured:
    """Wind and area weight of a film of a flag, as `flagdata measure` gives them; nothing is
    written.

    ```python
    found = flagdata.measure("flag.mp4", flag_size=(1.5, 1.0), area_weight="0.19±0.01")
    found.wind.value, found.wind.interval  # m/s
    ```

    A film unlike those the network was trained on is refused: it is returned with `refused` and the
    reasons, and asking it for values raises `RefusedError`.

    Raises:
        MissingExtraError: torch is not installed.
        UsageError: options that contradict each other, or values that no flag has.
        NotFoundError: no such film, lake or network.
        RefusedError: a film that is too slow, or whose frames repeat too often, so that no window
            of it can be looked at and there is nothing to return.
        InputError: a file that is no film, or a film that is too short.
    """
    return call("measure.commands.measure_film:measure_one", chosen)


@options
class Observing(OfFilm, BesideLake):
    """What is observed of a film."""

    source: Path | str = argument(
        "A video file, a folder of images, `example:NAME`, or a recording, clip or camera of the "
        "lake by its name or "
        "id.",
        "SOURCE",
    )
    flag_size: tuple[float, float] | str = option(
        f"{LENGTHS}; the height gives the scale.", section=FILM, metavar="LxH"
    )
    window: float = option(
        "Length of a window [s].", default=2.5, section=FILM, type=DURATION, metavar="TIME"
    )


@make_call(Observing)
def observe(chosen: Observing) -> Rows:
    """Droop, extension, speeds and frequencies of a filmed flag, window by window, as `flagdata
    observe` reads them.

    ```python
    seen = flagdata.observe("flag.mp4", flag_size=(1.5, 1.0))
    seen["time"], seen["droop"]  # (n,) s, (n,) rad, NaN where a window does not show it
    ```

    Nothing is written. `docs/method/films.md` defines each observable; what it is off by is in the
    column NAME-sigma, why a window shows none in NAME-reason.

    Raises:
        MissingExtraError: torch is not installed.
        NotFoundError: no such film or lake.
        RefusedError: the film has no whole window, or no window shows the cloth.
        UsageError: options that contradict each other, or values that no flag has.
    """
    return call("measure.commands.observe:observe_film", chosen)


@options
class OfFlag(OfCloth, FlagAndCamera):
    """What is stated of a filmed flag and of the log beside it."""

    material: str | None = option(
        "What the flag is made of, as in woven-polyester, knit or camel-ponte-roma; by default any "
        "fabric.",
        default=None,
        section=FLAG,
        metavar="NAME",
    )
    log: str | None = option(
        "Log of the wind beside tables that have no wind column: a wind of the lake, by its id.",
        default=None,
        section=BESIDE,
        metavar="ARTIFACT",
    )
    clock_offset: float | tuple[float, float] | str | Stated | None = option(
        "Seconds added to the tables' clock to reach the log's, as in 0.3±0.1; by default "
        "estimated.",
        default=None,
        section=BESIDE,
        type=STATED,
        metavar="S±SIGMA",
    )
    end: float | None = option(
        "Where to end [s]; two minutes are used at most.",
        default=None,
        section=FILM,
        type=DURATION,
        metavar="TIME",
    )
    cache: Path | str | None = option(
        "Where simulations are kept, so that an interrupted run goes on; by default the user's "
        "cache folder.",
        default=None,
        section=HOW,
        type=LocalPath(),
        metavar="FOLDER",
    )


@options
class Calibrating(OfFlag, Drawn, Keeping):
    """How the cloth of a flag is weighed, and the flag made an anemometer."""

    recordings: (
        Mapping[str, ArrayLike] | Path | str | Sequence[Mapping[str, ArrayLike] | Path | str]
    ) = argument(
        "One or several of one flag, each a table of observables as arrays of one length, in the "
        "units that "
        "`docs/weighing.md` lists (`time` [s], `wind` [m/s], `droop` [rad], …); the path of such a "
        "table; or a "
        "recording of the lake by its name or id. Or a folder of drapes (OBJ), or two, one for "
        "each face.",
        "RECORDING...",
    )
    flag_size: tuple[float, float] | str | None = option(
        f"{LENGTHS}; drapes have none.", default=None, section=FLAG, metavar="LxH"
    )
    area_weight: float | tuple[float, float] | str | Stated | None = option(
        "Area weight of the cloth of drapes [kg/m²], as in 0.192±0.004; a flag is weighed.",
        default=None,
        section=FLAG,
        type=STATED,
        metavar="VALUE",
    )
    only: str | None = option(
        "Do only one: weigh the cloth, in minutes of simulation, or calibrate the flag as an "
        "anemometer, as fast as "
        "its film is read.",
        default=None,
        section=HOW,
        type=click.Choice(["weight", "anemometer"]),
    )
    name: str | None = option(
        "Of the reading model, by which flagdata measure --model finds it; by default the first "
        "recording's with "
        "-anemometer.",
        default=None,
        section=HOW,
        metavar="NAME",
    )
    model: str | None = option(
        "Network whose summary the reading model uses; by default flow-outdoor.",
        default=None,
        section=HOW,
        metavar="NAME|FOLDER|ID",
    )
    simulations: int = option(
        "Simulated flags for each recording.", default=128, section=HOW, type=click.IntRange(min=64)
    )
    workers: int = option(
        "Number of processes that simulate.", default=1, section=HOW, type=POSITIVE
    )


@make_call(Calibrating)
def calibrate(chosen: Calibrating) -> Calibrated:
    """The cloth of a flag from its motion and the wind beside it, and the flag as an anemometer, as
    `flagdata calibrate` makes both.

    ```python
    table = {"time": time, "wind": wind, "droop": droop, "extension": extension}
    table["frequency"] = frequency
    found = flagdata.calibrate(table, flag_size=(1.5, 1.0), azimuth_deg="70±7")
    found.quantities["area_weight"].interval  # kg/m²
    ```

    It simulates flags for each recording, which takes minutes; they are kept for the next call.
    Films of a lake make a reading model, too, or with `only="anemometer"` alone: its name is what
    `flagdata.measure(model=…)` takes. Both are committed, unless `read_only=True`. Of folders of
    drapes, with `area_weight=`, it finds the bending (see `docs/cases/drapes.md`).

    Raises:
        MissingExtraError: torch is not installed.
        InputError: a table that cannot be used, or a log that does not cover it; scans that are no
            drapes.
        NotFoundError: no such recording or lake.
        RefusedError: no flag is found in a film; no simulated cloth drapes as scans do.
        UnknownNameError: a material like which no cloth was measured.
        UsageError: options that do not fit.
    """
    return call("measure.commands.calibrate_recordings:calibrate_recordings", chosen)


@options
class Closing:
    """How the model of a tracked cloth is judged."""

    recordings: ArrayLike | MeshSequence | Sequence[ArrayLike | MeshSequence] = argument(
        "Of one cloth, each positions of its markers (frame, marker, 3) [m], z up, NaN where a "
        "marker was not tracked; "
        "or a mesh sequence, which knows its rest coordinates and rate. One array of four axes is "
        "several.",
        "SOURCE...",
    )
    wind: float | tuple[float, float, float] | tuple[ArrayLike, ArrayLike] | Sequence[Any] = option(
        "One for all, or a list with one for each: a speed along +x [m/s], a velocity (x, y, z) "
        "[m/s], or a pair of "
        "times (n,) [s] since the first frame and velocities (n, 3) [m/s].",
    )
    rest: ArrayLike | None = option(
        "Places of the markers on the flat cloth (marker, 2) [m], u from the hoist, v upwards.",
        default=None,
    )
    rate: float | None = option("Frames a second [Hz].", default=None)
    material: str = option("Nominal material, of catalogs/materials.", default="camel-ponte-roma")
    attachment: str | Sequence[tuple[float, float]] = option(
        "How it is held: corners (of the hoist), top-corners, hoist, or places (u, v) on the flat "
        "cloth [m].",
        default="corners",
        was=("--pins",),
    )
    flag_size: tuple[float, float] | None = option(
        "Width and height of the flat cloth [m]; by default the outline of the markers.",
        default=None,
        was=("--size",),
    )
    area_weight: tuple[float, float] | str | Stated | None = option(
        "Of a cloth that was weighed [kg/m²], as in '0.155±0.005'; by default that of the "
        "material, to 30 %.",
        default=None,
    )
    density_uncertainty: float | None = option(
        "Relative standard uncertainty of the material's area weight.",
        default=None,
        now=BOTH_STATED,
    )
    noise: float | None = option(
        "Standard deviation of a coordinate [m]; by default it is estimated.", default=None
    )
    level: float | None = option(
        "Significance level of the test of the base model; 0.05 by default.", default=None
    )
    nulls: int | None = option(
        "Null recordings to simulate; by default as many as the test needs.", default=None
    )
    seed: int = option("Seed of the simulated nulls.", default=0)
    workers: int = option("Number of processes that simulate.", default=1)


@make_call(Closing)
def close_loop(chosen: Closing) -> Closed:
    """What the model of a tracked cloth lacks, as `flagdata close-loop` finds it.

    ```python
    verdict = flagdata.close_loop(
        [slow, fast], rest=rest, rate=25.0, wind=[4.0, 7.0], material="camel-ponte-roma"
    )
    verdict.named, verdict.strengths  # ("lift",), {"lift": coefficient 1.4 [0.8, 2.0]}
    ```

    It simulates null experiments, which takes minutes.

    Raises:
        MissingExtraError: torch is not installed.
        InputError: recordings that cannot be used, with the reason.
        UnknownNameError: a material that is not in the catalog.
        UsageError: winds that do not fit the recordings, or nulls that cannot test the level.
    """
    if (chosen.rest is None) != (chosen.rate is None):
        raise UsageError(
            "rest= and rate= must be given together", where="recordings", fix="give both"
        )
    return call("measure.closing.close_loop_call:close_on_arrays", chosen)


@options
class Proposing(ByNulls, NamedLake):
    """How an effect is sought and tested."""

    recipe: Path | str = argument("The recipe of the experiment.", "RECIPE.toml", type=LocalPath())
    effect: str | None = option(
        "Test this effect on the recordings and seek no other.",
        default=None,
        metavar="FILE.py:Class",
    )
    known: tuple[str, ...] = option(
        "Effect that the model has already; may be repeated.", default=(), metavar="EFFECT.STRENGTH"
    )
    out: Path | str = option(
        "Folder in which proposal/ is written: the effect file, its tests and proposals.json.",
        default=Path("out/close-loop"),
        type=LocalPath(),
    )


@make_call(Proposing)
def propose(chosen: Proposing) -> Proposed:
    """An effect that the library lacks, sought in a part of the recordings and tested on the rest.

    ```python
    tried = flagdata.propose("flag.toml", known=("lift.coefficient",), workers=2)
    tried.decision, tried.reason, tried.effect  # "kept", why, the effect's file and class
    tried.save("proposal.html")
    ```

    It simulates null experiments, which takes minutes, and adds what it tried to `proposals.json`
    in the folder `out`.

    Returns:
        The outcome, with strengths, page, and as `document` what `flagdata propose --json` prints.

    Raises:
        MissingExtraError: torch is not installed.
        InputError: a recipe or recordings that cannot be used, with the reason.
        NotFoundError: no such recipe, lake or recording.
        UsageError: nulls that cannot test the level.
    """
    return attribute("measure.commands.propose:propose").result(chosen)
