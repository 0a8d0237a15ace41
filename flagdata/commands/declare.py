"""`flagdata declare`: the constant wind of a film, stated instead of measured."""

from __future__ import annotations

import click

from flagdata.console import document, echo, json_option, lake_option, progress


@click.command()
@click.argument("camera")
@click.option("--speed", type=float, required=True, metavar="M/S", help="Speed of the wind all along.")
@click.option("--sigma", type=float, required=True, metavar="M/S", help="Its standard uncertainty.")
@click.option("--name", help="What to call the recording; the camera's name by default.")
@click.option("--session", help="One set-up at one place, for splits; the camera's by default.")
@click.option("--branch", default="main", show_default=True, help="Branch to commit on.")
@json_option
@lake_option
def declare(
    camera: str,
    speed: float,
    sigma: float,
    name: str | None,
    session: str | None,
    branch: str,
    as_json: bool,
    lake_path: str,
) -> None:
    """State that the wind of the artifact CAMERA was constant, as in a wind tunnel: a recording and its clips.

    When it was filmed does not matter then: ingest a film whose start nobody knows by --start unknown. The declared
    wind becomes a wind artifact of its own, and recording and clips bear the quality flag wind-declared.
    """
    from flagdata.align.constant import ConstantWind, declared_recording
    from flagdata.lake import Lake
    from flagdata.schema import Kind

    wind = ConstantWind(speed=speed, sigma=sigma)
    lake = Lake.open(lake_path)
    lake.check_writable()
    film = lake.artifact(camera, at=branch, kinds=(Kind.CAMERA,))
    with progress(film.frame_count, label="copying", unit="frame") as advance:
        stated, made = declared_recording(lake, film, wind, name=name, session=session, branch=branch, progress=advance)
    if as_json:
        document(
            "declare",
            {"wind": stated.id, **made.as_dict()},
        )
        return
    echo(f"wind {speed:g} ± {sigma:g} m/s declared: {stated.id}")
    echo(made.line)
