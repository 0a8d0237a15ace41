"""Options that several verbs share, each stated once: a verb's class of options inherits those that
it takes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.core.console import LakePlace, LocalPath
from flagdata.core.workload import cores
from flagdata.verbs.option_types import DURATION, POSITIVE, SHARE, STATED
from flagdata.verbs.verb_options import option, options

if TYPE_CHECKING:
    from flagdata.core.stated import Stated
    from flagdata.dataset.lake_source import AnyLake
    from flagdata.lake import Lake

LAKE = "The lake's folder, or s3://bucket/prefix."
ATTACHMENTS = ("corners", "hoist")
RECORDING = "The recording"
FILM = "The film"
FLAG = "The flag and the camera"
HOW = "How it is done"
BOTH_STATED = "the weight and its uncertainty as one area weight, 0.155±0.003"
"""What says now what `density_uncertainty` said."""
WRITTEN = "What is written"
TEST = "The test"


@options
class OnLake:
    """The lake that a verb is about."""

    lake: AnyLake = option(LAKE, default=".", envvar="FLAGDATA_LAKE", metavar="DIR")

    def opened(self) -> Lake:
        """Opens the lake.

        Raises:
            NotFoundError: there is none.
        """
        from flagdata.dataset.lake_source import open_source

        return open_source(self.lake).lake

    def found(self) -> Lake:
        """Finds the lake, also one that cannot be opened, for what heals it.

        Raises:
            NotFoundError: there is none.
        """
        from flagdata.dataset.lake_source import Source
        from flagdata.lake import Lake

        return self.opened() if isinstance(self.lake, Source | Lake) else Lake.found(self.lake)


@options
class AtVersion:
    """The version of a lake that a verb looks at."""

    at: str | None = option(
        "Tag, branch, version number, commit, or main at a time: 2026-11-26 (its end, UTC), "
        "3.days.ago; the head of "
        "main by default.",
        default=None,
        metavar="REF",
    )


@options
class NamedRecording:
    """What a recording is called."""

    name: str | None = option(
        "What to call the recording; the camera's name by default.", default=None, section=RECORDING
    )
    session: str | None = option(
        "One set-up at one place, for splits; the parents' by default.",
        default=None,
        section=RECORDING,
    )


@options
class Reasoned:
    """Why a commit is made, for the log."""

    message: str | None = option("Why.", "--message", "-m", default=None)


@options
class Rehearsed:
    """Whether something is only looked at."""

    dry_run: bool = option("Say what would be done; commit and delete nothing.", default=False)


@options
class OfGarbage:
    """What is garbage."""

    grace: float = option(
        "How old something must be, with nothing referring to it, to be garbage [s], as in 24h.",
        "--older-than",
        default=86_400.0,
        type=DURATION,
        show_default="24h",
        metavar="AGE",
    )


@options
class InFull:
    """How much of many relatives is listed."""

    whole: bool = option(
        "All columns and all relatives, also where there are many.", "--all", default=False
    )


@options
class Shared:
    """Among how many processes or threads work is shared."""

    workers: int | None = option(
        "Number of processes or threads; by default one for each core.",
        default=None,
        section=HOW,
        type=POSITIVE,
        metavar="N",
    )

    @property
    def processes(self) -> int:
        """How many processes or threads compute."""
        return self.workers or cores()


@options
class ByNulls(Shared):
    """By which null experiments is tested, and at which level."""

    level: float | None = option(
        "Significance level of the test; 0.05 by default.", default=None, section=TEST, type=SHARE
    )
    nulls: int | None = option(
        "Number of recordings without any effect to simulate for comparison, 160 or more; on films "
        "the number of "
        "meshes and time-stepping methods, 20 by default.",
        default=None,
        section=TEST,
        type=POSITIVE,
    )
    bank: Path | None = option(
        "Folder of such simulations that were made before, by the study `challenge bank` of a "
        "checkout.",
        default=None,
        section=TEST,
        type=LocalPath(exists=True),
    )
    scheduler: str | None = option(
        "Dask scheduler whose workers simulate, tcp://HOST:PORT; without it, this machine.",
        default=None,
        section=HOW,
        metavar="ADDRESS",
    )
    seed: int = option(
        "Seed of the simulated nulls.", default=0, section=TEST, type=click.IntRange(min=0)
    )


@options
class Computed(Shared):
    """Where something is computed."""

    device: str = option("Where to compute: cpu, cuda, cuda:1.", default="cpu", section=HOW)


@options
class NamedLake:
    """The lake that names recordings and takes results, where there is one."""

    lake: AnyLake | None = option(
        "Where recordings and artifacts are, and where results go: a folder, or "
        "s3://bucket/prefix.",
        default=None,
        type=LakePlace(),
        envvar="FLAGDATA_LAKE",
        metavar="DIR",
    )


@options
class BesideLake(NamedLake):
    """The same, at one of its versions."""

    at: str | None = option(
        "Tag, branch or version of the lake to look at; by default the branch's head.",
        default=None,
        metavar="REF",
    )


@options
class OnBranch:
    """The branch of a lake that a verb commits on."""

    branch: str = option("Branch of the lake to commit on.", default="main")


@options
class Committing(OnBranch):
    """Whether and where a verb commits what it found."""

    read_only: bool = option("Read the lake, commit nothing.", default=False)


@options
class Keeping(BesideLake, Committing):
    """A lake beside what a command reads, in which it keeps what it finds."""

    @property
    def version(self) -> str:
        """The version of the lake that is looked at."""
        return self.branch if self.at is None else self.at

    def opened(self) -> Lake | None:
        """Opens the lake, if one was named; unless it is only read it can be written."""
        from flagdata.dataset.lake_source import lake_of

        lake = lake_of(self.lake)
        if lake is not None and not self.read_only:
            lake.check_writable()
        return lake


@options
class OfCloth:
    """Which cloth of a film, and which part of its time."""

    crop: tuple[int, int, int, int] | str | None = option(
        "Region in which the flag is: x, y, width, height [px]; by default the whole picture.",
        default=None,
        section=FILM,
        metavar="X,Y,W,H",
    )
    flag: int | None = option(
        "Which moving cloth, as numbered on the page of measure --report; by default the one that "
        "moves most.",
        default=None,
        section=FILM,
        type=POSITIVE,
        metavar="N",
    )
    start: float | None = option(
        "Where to begin in the film [s], as in 12s.",
        default=None,
        section=FILM,
        type=DURATION,
        metavar="TIME",
    )
    end: float | None = option(
        "Where to end [s].", default=None, section=FILM, type=DURATION, metavar="TIME"
    )


@options
class OfFilm(OfCloth):
    """The same, and the rates of a film that is a file."""

    true_fps: float | None = option(
        "Rate at which a high-speed camera really ran [Hz].",
        default=None,
        section=FILM,
        metavar="HZ",
    )
    sequence_fps: float | None = option(
        "Rate of a folder of images [Hz].", default=None, section=FILM, metavar="HZ"
    )


@options
class Drawn:
    """The intervals of an answer and the draws behind them."""

    level: float = option("Level of the intervals.", default=0.9, section=HOW, type=SHARE)
    seed: int = option("Seed of all draws.", default=0, section=HOW, type=click.IntRange(min=0))


@options
class FlagAndCamera:
    """How a flag is held and seen, as far as it is known."""

    attachment: str = option(
        "How the flag is held: at both corners of its hoist, or along all of it.",
        default="corners",
        section=FLAG,
        type=click.Choice(ATTACHMENTS),
    )
    azimuth_deg: float | tuple[float, float] | str | Stated | None = option(
        "Of the camera's axis to the wind [°], 90 from the side, as in 70±7; by default 30:150.",
        "--azimuth",
        default=None,
        section=FLAG,
        type=STATED,
        metavar="DEGREES",
    )
    elevation_deg: float | tuple[float, float] | str | Stated | None = option(
        "Of the camera's axis, upwards [°]; by default 0±5.",
        "--elevation",
        default=None,
        section=FLAG,
        type=STATED,
        metavar="DEGREES",
    )
    distance: float | None = option(
        "From the camera to the flag [m].",
        default=15.0,
        section=FLAG,
        type=click.FloatRange(min=1.0),
        metavar="M",
    )
