"""The example that comes with the package: a short recording of a simulated flag, made from its
seed.

`python -m tests.studies example --out flagdata/examples/flag` makes it anew. The flag is of the
scene `flag-outdoor-damped`, from which the network learned, with a seed of its own and in gusts,
which the network did not learn from.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import click
import numpy as np

from flagdata.core.console import LocalPath, say
from flagdata.core.files.outputs import fresh_folder
from flagdata.core.rng import child_seed
from flagdata.timebase import NANOSECONDS, from_datetime
from measure.demo import CUP
from measure.simulated_camera import write_film
from sim.assets import Assets
from sim.datasets import log_of_air, velocities
from sim.render import render_prior
from sim.run import Crew, Stepper, recipe_of, run

SEED = 54
SCENE = "flag-outdoor-damped"
RATE, SECONDS = 25, 12
"""Hz and s of the film: ten windows of the network."""
GIVEN = {
    "count": 1,
    "batch": 1,
    "material": {"area-weight": 0.18},
    "wind": {"speed": 5.0},
    "effects": {"gusts": {"intensity": 0.15}},
    "time": {"settle": 3.0, "frames": RATE * SECONDS, "rate": float(RATE)},
}
"""In place of what the scene draws."""
START = datetime(2026, 5, 14, 9, 30, tzinfo=UTC)
"""When the camera starts, by its own clock."""
OFFSET = 17.4
"""s by which the logger's clock is ahead of the camera's."""
_AIR_RATE = 10.0  # Hz, at which the air is sampled
_HEADING = "time,wind_speed [m/s],wind_direction [deg]"
_ABOUT = """\
title = "a simulated flag in gusts, {seconds} s, and the log of a cup anemometer beside it"
film = "flag.mp4"
log = "anemometer.csv"
flag-size = [{length}, {height}]  # m
clock-offset = {offset}  # s, added to the film's clock to reach the log's

[truth]  # what was simulated, SI
wind_speed = {wind:.3f}  # mean over the film
area_weight = {area_weight}
damping = {damping:.5f}
"""


def make(folder: Path, *, seed: int) -> None:
    """Write the film, the log and `example.toml` into `folder`."""
    recipe = recipe_of(SCENE, {**GIVEN, "seed": seed})
    crew = Crew(recipe)
    member = crew.member(0)
    (outcome,) = run(crew, Stepper.of(crew, member.base), [member], size=1)
    assert outcome.sequence is not None, outcome.failure
    zeta = (
        render_prior.named_prior("outdoor")
        .with_quantities({"width": 400, "height": 300, "raster_samples": 4}, source="the example")
        .draw(child_seed(seed, "example", "look"), Assets())
    )
    write_film(
        folder / "flag.mp4",
        outcome.sequence,
        zeta,
        rate=RATE,
        start=START,
        seed=child_seed(seed, "example", "film"),
        workers=1,
        advance=lambda frames: None,
    )
    settled = recipe.time.settling / RATE
    times = np.arange(round((settled + SECONDS) * _AIR_RATE) + 1) / _AIR_RATE
    velocity = velocities(crew.assemble([member])[0], times)
    wind = float(np.hypot(velocity[:, 0], velocity[:, 1])[times >= settled].mean())
    begin = from_datetime(START) - round(settled * NANOSECONDS)
    series = log_of_air(CUP, times, velocity, instrument=seed, seed=seed, begin=begin).series
    first = START + timedelta(
        seconds=(int(series.time[0]) - from_datetime(START)) / NANOSECONDS + OFFSET
    )
    speeds, degrees = series.channels["wind_speed"], np.degrees(series.channels["wind_direction"])
    lines = [
        f"{(first + timedelta(seconds=second)).isoformat(timespec='milliseconds')},{speed:.1f},{direction:.0f}"
        for second, (speed, direction) in enumerate(
            zip(speeds.tolist(), degrees.tolist(), strict=True)
        )
    ]
    (folder / "anemometer.csv").write_text("\n".join([_HEADING, *lines]) + "\n", encoding="utf-8")
    (folder / "example.toml").write_text(
        _ABOUT.format(
            seconds=SECONDS,
            length=recipe.scene.width,
            height=recipe.scene.height,
            offset=OFFSET,
            wind=wind,
            area_weight=member.parameters["area_weight"],
            damping=member.parameters["damping"],
        ),
        encoding="utf-8",
    )


@click.command()
@click.option(
    "--out", type=LocalPath(), required=True, help="Folder of the example, which is not there yet."
)
@click.option(
    "--seed", type=int, default=SEED, show_default=True, help="Seed of all that is random."
)
def main(out: Path, seed: int) -> None:
    """Make the example that comes with the package."""
    with fresh_folder(out) as scratch:
        make(scratch, seed=seed)
    say(f"wrote {out}")
