"""`flagdata declare`: the constant wind of a film, stated instead of measured."""

from __future__ import annotations

from collections.abc import Iterator

from flagdata.core.console import echo, progress
from flagdata.core.json_values import json_values
from flagdata.verbs.shared_options import RECORDING, NamedRecording, OnBranch, OnLake
from flagdata.verbs.verb_options import Result, argument, option, options, verb


@options
class Declaring(NamedRecording, OnBranch, OnLake):
    """Which film had which wind."""

    camera: str = argument("A camera of the lake by its name or id.", "CAMERA")
    speed: float = option("Speed of the wind all along [m/s].", section=RECORDING, metavar="M/S")
    sigma: float = option("Its standard uncertainty [m/s].", section=RECORDING, metavar="M/S")


@verb(
    Declaring,
    example='flagdata.declare("tunnel", speed=6.0, sigma=0.1, lake="field.lake")["recording"]',
)
def declare(chosen: Declaring) -> Iterator[Result]:
    """State that the wind of the artifact CAMERA was constant, as in a wind tunnel: a recording and
    its clips.

    When it was filmed does not matter then: ingest a film whose start nobody knows by --start
    unknown. The declared wind becomes a wind artifact of its own, and recording and clips bear the
    quality flag wind-declared.
    """
    from flagdata.align.constant import ConstantWind, declared_recording
    from flagdata.core.schema import Kind

    wind = ConstantWind(speed=chosen.speed, sigma=chosen.sigma)
    lake = chosen.opened()
    lake.check_writable()
    film = lake.artifact(chosen.camera, at=chosen.branch, kinds=(Kind.CAMERA,))
    with progress(film.frame_count, label="copying", unit="frame") as advance:
        stated, made = declared_recording(
            lake,
            film,
            wind,
            name=chosen.name,
            session=chosen.session,
            branch=chosen.branch,
            progress=advance,
        )
    yield Result("declare", {"wind": stated.id, **json_values(made)})
    echo(f"wind {wind.speed:g} ± {wind.sigma:g} m/s declared: {stated.id}")
    echo(made.line)
