"""`flagdata close-loop`: recordings in, a verdict and its report out."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.console import document, json_option, say
from flagdata.errors import InputError, UsageError
from flagdata.findings import Finding, Severity

if TYPE_CHECKING:
    from measure.loop.close import Stage
    from measure.loop.verdict import Verdict
    from measure.observe import Setup


@click.command("close-loop")
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True)
@click.option("--wind", "winds", multiple=True, metavar="M/S|LOG|ID", help="One for all recordings, or one for each.")
@click.option("--axis", default="1,0,0", show_default=True, metavar="X,Y,Z", help="Where the air of a speed goes.")
@click.option("--offset", type=float, default=0.0, show_default=True, help="From a log's first sample to frame 1 [s].")
@click.option("--material", help="Nominal cloth, of the catalog; by default the source's own.")
@click.option("--size", metavar="WxH", help="Of the flat cloth [m]; by default the markers' outline.")
@click.option("--pins", help="hoist-corners, top-corners, hoist, or u,v;u,v;… [m]; by default the source's own.")
@click.option("--rate", type=click.FloatRange(min=0, min_open=True), help="Frames a second, if the source is silent.")
@click.option("--unit", default="m", show_default=True, help="Of positions.")
@click.option("--noise", type=click.FloatRange(min=0), help="Of a marker's coordinate [m]; estimated by default.")
@click.option("--nulls", type=click.IntRange(min=64), default=192, show_default=True, help="Null recordings.")
@click.option("--bank", type=click.Path(path_type=Path, exists=True), help="Nulls made before, for such a design.")
@click.option("--level", type=click.FloatRange(0, 1, min_open=True, max_open=True), default=0.03, show_default=True,
              help="Of the global test.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the nulls.")
@click.option("--workers", type=click.IntRange(min=1), help="Processes; by default one for each core.")
@click.option("--lake", "lake_path", type=click.Path(path_type=Path), help="Where artifacts are.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/close-loop"), show_default=True,
              help="Folder for report.html and verdict.json.")  # fmt: skip
@json_option
def close_loop(
    sources: tuple[str, ...],
    winds: tuple[str, ...],
    axis: str,
    offset: float,
    material: str | None,
    size: str | None,
    pins: str | None,
    rate: float | None,
    unit: str,
    noise: float | None,
    nulls: int,
    bank: Path | None,
    level: float,
    seed: int,
    workers: int | None,
    lake_path: Path | None,
    out: Path,
    as_json: bool,
) -> None:
    """Find what the model of a cloth lacks, name it, and say what adding it changes on unseen data.

    SOURCE is the output folder of an ArcSim run, a table of tracked markers (CSV or Parquet with the columns frame or
    time, marker, u, v, x, y, z, and recording if there are several), or a mesh sequence of --lake by its id. Several
    are recordings of one cloth, best in different winds.

    \b
      flagdata close-loop run-4ms/ run-8ms/ --wind 4 --wind 8
      flagdata close-loop tracks.csv --wind anemometer.csv --material camel-ponte-roma --pins hoist-corners
    """
    from measure.loop.close import Options
    from measure.loop.close import close_loop as close
    from measure.loop.sources import Reading, read
    from measure.observe import observe
    from measure.report.document import as_document
    from measure.report.page import write_page
    from measure.report.words import words

    reading = Reading(lake=lake_path, rate=rate, unit=unit, noise=noise, axis=_vector(axis), offset=offset)
    observed = observe(read(sources, winds, reading), _setup(material, size, pins))
    _refuse(observed.findings)
    options = Options(seed=seed, level=level, nulls=nulls, bank=bank, workers=workers or len(os.sched_getaffinity(0)))
    verdict = close(observed.experiment, options, stage=_stage())
    verdict = replace(verdict, findings=tuple((f.kind, f.what) for f in observed.findings))
    out.mkdir(parents=True, exist_ok=True)
    write_page(verdict, out / "report.html")
    (out / "verdict.json").write_text(json.dumps(as_document(verdict), indent=1) + "\n", encoding="utf-8")
    _tell(verdict, out, as_json=as_json, words=words(verdict))


def _tell(verdict: Verdict, out: Path, *, as_json: bool, words: str) -> None:
    from measure.report.document import as_document

    if as_json:
        content = as_document(verdict)
        content.pop("schema")
        document("verdict", content)
    else:
        click.echo(words)
    say(f"wrote {out / 'report.html'} and {out / 'verdict.json'}")


def _vector(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(f"{text!r} is not three numbers", where="--axis", fix="give x,y,z") from error
    return x, y, z


def _setup(material: str | None, size: str | None, pins: str | None) -> Setup:
    from measure.observe import Hold, Setup, sheet
    from sim.material import named

    outline = None
    if size is not None:
        try:
            width, height = (float(part) for part in size.lower().split("x"))
        except ValueError as error:
            raise UsageError(f"{size!r} is not a size", where="--size", fix="give 1.5x1.0, in metres") from error
        outline = sheet(width, height)
    held: Hold | tuple[tuple[float, float], ...] | None = None
    if pins is not None:
        held = Hold(pins) if pins in {h.value for h in Hold} else _places(pins)
    return Setup(material=None if material is None else named(material), outline=outline, pins=held)


def _places(text: str) -> tuple[tuple[float, float], ...]:
    places: list[tuple[float, float]] = []
    for part in text.split(";"):
        try:
            u, v = (float(value) for value in part.split(","))
        except ValueError as error:
            raise UsageError(
                f"{part!r} is no place on the cloth", where="--pins", fix="give hoist-corners, or u,v;u,v in metres"
            ) from error
        places.append((u, v))
    return tuple(places)


def _refuse(findings: Iterable[Finding]) -> None:
    """Errors end it here: what is wrong with the data must not come out as an effect."""
    for finding in findings:
        if finding.severity is Severity.ERROR:
            raise InputError(finding.what, where=finding.where, fix=finding.fix or "correct the data")
        say(f"{finding.severity.value}: {finding.what}")


def _stage() -> Stage:
    """Stages as lines, nulls as a bar: they take most of the time."""
    from tqdm import tqdm

    bars: dict[str, tqdm] = {}

    def tell(what: str, done: int, total: int) -> None:
        if what not in bars:
            bars[what] = tqdm(total=total, desc=what, ncols=100, mininterval=1.0)
        bars[what].update(done - bars[what].n)
        if done >= total:
            bars[what].close()

    return tell
