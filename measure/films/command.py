"""`flagdata close-loop` on films with logs and on tables of observables: read, judged, written."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from pathlib import Path

import click

from flagdata.caches import user_cache
from flagdata.console import document, in_steps, progress, say
from flagdata.errors import UsageError
from flagdata.lake import Lake
from flagdata.outputs import check_files, write_files
from flagdata.stated import Stated
from measure.calibrate.calibrate import Options as Calibrating
from measure.calibrate.command import known
from measure.calibrate.filmed import of_source
from measure.calibrate.observed import Observed
from measure.calibrate.prior import AZIMUTH, ELEVATION
from measure.calibrate.simulation import Flag
from measure.closing import toml
from measure.closing.artifacts import Kept
from measure.closing.command_line import stage_bars
from measure.estimate.similarity import parse_size
from measure.estimate.source import Reading, box_of
from measure.films.artifacts import ClosedOnFilms, keep
from measure.films.command_line import Given
from measure.films.models import models
from measure.films.page import page
from measure.films.run import Options, solve, verdict_of
from measure.films.words import words
from measure.report.document import as_document
from measure.verdict.criteria import CRITERIA

FILES = ("report.html", "verdict.json", "base.toml", "model.toml")
"""What is written; the last one only where an effect was found."""
_RELATIVE = 0.01
"""Standard uncertainty of a weight that is stated without one, as a share."""


def close_films(
    sources: Sequence[str],
    given: Given,
    *,
    lake: Lake | None,
    branch: str,
    name: str | None,
    out: Path,
    level: float | None,
    nulls: int | None,
    seed: int,
    workers: int | None,
    as_json: bool,
) -> None:
    """Judge recordings of one flag, and write what came out.

    Args:
        nulls: kinds of numerics.

    Raises:
        FlagdataError: sources that cannot be judged; nothing is written then.
    """
    if given.flag_size is None:
        raise UsageError(
            "the flag's size is missing: what is simulated is a flag of its size", where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )  # fmt: skip
    begun = time.monotonic()
    check_files(out, *FILES, command="close-loop")
    size = parse_size(given.flag_size)
    options = Options(
        calibration=Calibrating(
            flag=Flag(length=size.length, height=size.height, attachment=given.attachment),
            azimuth=AZIMUTH if given.azimuth is None else known(AZIMUTH, given.azimuth, where="--azimuth"),
            elevation=ELEVATION if given.elevation is None else known(ELEVATION, given.elevation, where="--elevation"),
            distance=given.distance, simulations=given.simulations, seed=seed,
        ),
        area_weight=None if given.area_weight is None else weight(given.area_weight),
        level=CRITERIA.level if level is None else level, kinds=CRITERIA.simulated_kinds if nulls is None else nulls,
    )  # fmt: skip
    reading = Reading(crop=box_of(given.crop), flag=given.flag, aspect=size.aspect)
    with progress(None, label="observe", unit="window") as advance:
        read = [
            of_source(
                source,
                size,
                reading,
                lake=lake,
                at=branch,
                first=given.first,
                last=given.last,
                log=given.log,
                offset=given.clock_offset,
                advance=advance,
            )
            for source in sources
        ]
    recordings = distinct([one for own, _ in read for one in own])
    outcome = solve(
        recordings, options, folder=given.cache or user_cache() / "calibrate",
        workers=workers or len(os.sched_getaffinity(0)), stage=stage_bars(),
    )  # fmt: skip
    verdict = replace(verdict_of(outcome), seconds=time.monotonic() - begun)
    called = name or recordings[0].name
    closed = ClosedOnFilms(
        name=called, outcome=outcome, verdict=verdict, models=models(verdict, outcome, name=called),
        page=page(verdict, outcome), reading=reading.recipe(),
        parents=tuple(dict.fromkeys(recording for _, recording in read if recording is not None)),
    )  # fmt: skip
    content = json.dumps(as_document(verdict), indent=1, allow_nan=False)
    texts = [closed.page, content + "\n", *(toml.dumps(model.content) for model in closed.models)]
    write_files(out, dict(zip_longest(FILES, texts)), command="close-loop")
    with in_steps(lambda: f"the report and the models in {out}"):
        kept = None if lake is None else keep(lake, closed, branch=branch)
    _print(closed, kept, out, as_json=as_json)


def weight(stated: Stated) -> tuple[float, float]:
    """Mean and standard deviation of a stated area weight [kg/m²]; of a range those of a uniform distribution.

    Raises:
        UsageError: a weight that no cloth has.
    """
    middle = (stated.low + stated.high) / 2
    if not middle > 0:
        raise UsageError(f"{stated.text} kg/m²", where="--area-weight", fix="give one above 0, as in 0.155±0.005")
    return middle, max(stated.sigma, (stated.high - stated.low) / 12**0.5, _RELATIVE * middle)


def distinct(recordings: Sequence[Observed]) -> list[Observed]:
    """Recordings with names made different where two are the same."""
    names = [one.name for one in recordings]
    return [
        replace(one, name=f"{one.name} ({number})") if names.count(one.name) > 1 else one
        for number, one in enumerate(recordings, start=1)
    ]


def _print(closed: ClosedOnFilms, kept: Kept | None, out: Path, *, as_json: bool) -> None:
    if as_json:
        content = as_document(closed.verdict)
        content.pop("schema")
        if kept is not None:
            content["artifacts"] = {
                "measurement": kept.measurement, "models": list(kept.models), "existing": kept.existing
            }  # fmt: skip
        document("verdict", content)
    else:
        click.echo(words(closed.verdict))
    if kept is not None and kept.existing:
        say(f"the lake has this measurement already: {kept.measurement}")
    elif kept is not None:
        say(f"measurement {kept.measurement}")
        for model, identity in zip(closed.models, kept.models, strict=True):
            say(f"model {identity} {model.name}")
    say(f"wrote {', '.join(str(out / file) for file in FILES[: 2 + len(closed.models)])}")
