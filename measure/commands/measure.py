"""`flagdata measure`: wind and cloth of a film, with intervals, or the reason why not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.commands.durations import DURATION
from flagdata.commands.sections import LongCommand
from flagdata.commands.statements import STATED
from flagdata.console import (
    LakePlace,
    LocalPath,
    csv_rows,
    document,
    echo,
    following,
    json_option,
    progress,
    say,
    say_finding,
)
from flagdata.errors import RefusedError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.printable import SHORT
from flagdata.storage import Place
from measure.film_options import film_options

if TYPE_CHECKING:
    from flagdata.lake import Lake
    from flagdata.stated import Stated
    from measure.anemometer.network import Network
    from measure.estimate.measuring import Measurement, Options
    from measure.estimate.series import Beside
    from measure.film.source import Reading, Subject
    from measure.refine.refinement import Refinement


@click.command(cls=LongCommand)
@click.argument("source", required=False, metavar="[SOURCE]")
@click.option("--query", metavar="EXPR", help='SQL condition over clips, instead of SOURCE: "wind between 3 and 6".')
@click.option(
    "--flag-size",
    metavar="LxH",
    help="Length along the wind and height along the pole [m], as in 1.5x1.0; of a hanging cloth its width and height.",
)
@click.option(
    "--area-weight",
    type=STATED,
    metavar="VALUE",
    help="Area weight of the cloth [kg/m²]: 0.284, 0.284±0.01 (deviation) or 0.27:0.30.",
)
@click.option(
    "--material",
    metavar="NAME",
    help="Cloth whose area weight is taken, a material of the catalog or a "
    "fabric that films of the lake declare; nothing else of it is used.",
)
@click.option(
    "--windows",
    "--window",
    "step",
    type=DURATION,
    metavar="TIME",
    help="A wind series, one window every so often, as in 1.2s.",
)
@film_options
@click.option(
    "--level",
    type=click.FloatRange(0, 1, min_open=True, max_open=True),
    default=0.9,
    show_default=True,
    help="Level of the intervals.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of all draws.")
@click.option(
    "--model",
    metavar="NAME|FOLDER|ID",
    help="Network that measures, or reading model of flagdata calibrate; by default flow-outdoor, of flags.",
)
@click.option(
    "--refine",
    type=click.IntRange(min=20),
    metavar="N",
    help="Refine the first window by N simulated clips, 20 or more; 50 take minutes.",
)
@click.option(
    "--cache",
    type=LocalPath(),
    metavar="FOLDER",
    help="Where simulated clips are kept, so that an interrupted refinement goes on.",
)
@click.option(
    "--false-alarm",
    type=click.FloatRange(0, 1, min_open=True, max_open=True),
    default=0.05,
    show_default=True,
    help="Share of familiar films that the gate may refuse.",
)
@click.option(
    "--anyway",
    is_flag=True,
    help="Show, marked, what the model says of a film that the gate refuses, if anything moves in it.",
)
@click.option("--report", type=LocalPath(), metavar="FILE.html", help="Write a page that needs no other.")
@click.option(
    "--zarr", "zarr_path", type=LocalPath(), metavar="FOLDER", help="Write draws and series as a Zarr data set."
)
@click.option("--csv", "as_csv", is_flag=True, help="The windows as comma-separated values on stdout.")
@click.option(
    "--lake",
    "lake_path",
    type=LakePlace(),
    envvar="FLAGDATA_LAKE",
    help="Where artifacts are, and where measurements go; also FLAGDATA_LAKE.",
)
@click.option(
    "--at", metavar="REF", help="Tag, branch or version of the lake to look at; by default the branch's head."
)
@click.option("--branch", default="main", show_default=True, help="Branch of the lake to commit on.")
@click.option("--read-only", is_flag=True, help="Read the lake, commit nothing.")
@json_option
def measure(
    source: str | None,
    query: str | None,
    flag_size: str | None,
    area_weight: Stated | None,
    material: str | None,
    step: float | None,
    crop: str | None,
    flag: int | None,
    first: float | None,
    last: float | None,
    true_fps: float | None,
    sequence_fps: float | None,
    level: float,
    seed: int,
    model: str | None,
    refine: int | None,
    cache: Path | None,
    false_alarm: float,
    anyway: bool,
    report: Path | None,
    zarr_path: Path | None,
    as_csv: bool,
    lake_path: Place | None,
    at: str | None,
    branch: str,
    read_only: bool,
    as_json: bool,
) -> None:
    """Measure wind and area weight from a film of a flag, with intervals.

    SOURCE is a video file, a folder of images, a recording, clip or camera of --lake by its name or id, or the film
    that comes with the package, example:flag, whose truth is printed beside. A gate looks first: a film unlike
    those the network was trained on is refused with the reason, exit code 3, and nothing estimated is shown. With
    --lake the measurement becomes an artifact; the same one by the same code again adds nothing.

    \b
      flagdata measure example:flag
      flagdata measure clip.mp4 --flag-size 1.5x1.0 --report clip.html
      flagdata measure recording-7 --lake lake --windows 1.2s --csv
      flagdata measure --lake lake --query "wind between 3 and 6" --json
    """
    if as_json and as_csv:
        raise UsageError("more than one form of output", fix="choose one of --json and --csv")
    if cache is not None and refine is None:
        raise UsageError("--cache without --refine", fix="give --refine N, or leave --cache out")
    from flagdata.lake import Lake
    from flagdata.outputs import check_file, check_folder
    from measure.anemometer.network import network
    from measure.commands.measuring import weight
    from measure.estimate.measuring import Options
    from measure.film.similarity import parse_size
    from measure.film.source import Reading, box_of, size_of, subjects

    if report is not None:
        check_file(report, command="measure")
    if zarr_path is not None:
        check_folder(zarr_path)
    box = box_of(crop)
    lake = None if lake_path is None else Lake.open(lake_path)
    if lake is not None and not read_only:
        lake.check_writable()
    seen = at if at is not None else branch
    stated, origin = weight(area_weight, material, lake=lake, at=seen)
    if stated is not None and origin is not None:
        say(f"area weight {stated.text} kg/m² of {material}: {origin}")
    size = size_of(source, None if flag_size is None else parse_size(flag_size))
    aspect = None if size is None else size.aspect
    reading = Reading(crop=box, flag=flag, aspect=aspect, true_fps=true_fps, sequence_fps=sequence_fps)
    options = Options(
        size=size,
        step=step,
        first=first,
        last=last,
        level=level,
        false_alarm=false_alarm,
        seed=seed,
        refine=refine,
        area_weight=stated,
    )
    found = subjects(source, query=query, lake=lake, at=seen, reading=reading)
    job = _Job(
        options=options,
        reading=reading,
        network=network(model, lake=lake, at=seen),
        lake=lake,
        at=seen,
        branch=branch,
        commit=not read_only,
        anyway=anyway,
        report=report,
        zarr=zarr_path,
        cache=cache,
    )
    if query is not None:
        if report is not None or zarr_path is not None or as_csv or refine is not None:
            raise UsageError(
                "a page, a Zarr, a CSV or a refinement is of one film", fix="measure one clip by its id, or use --json"
            )
        _several(job, found, as_json=as_json)
        return
    done = job.do(found[0])
    job.refuse(done)
    if as_json:
        document("measure", done.as_dict(anyway=anyway))
    elif as_csv:
        csv_rows(done.series.rows())
    else:
        _report(done, series=step is not None)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Done:
    measured: Measurement
    series: Beside
    artifact: str | None
    subject: Subject
    refinement: Refinement | None

    def as_dict(self, *, anyway: bool) -> dict[str, Any]:
        shown = self.measured.shown(anyway=anyway)
        known = self.subject.known or {}
        return {
            **self.measured.as_dict(anyway=anyway),
            "series": self.series.as_dict() if shown else None,
            "source": None if self.subject.artifact is None else self.subject.artifact.id,
            "artifact": self.artifact,
            "refinement": None if self.refinement is None else self.refinement.as_dict(),
            "conditioning": self.subject.film.as_dict(),
            "simulated_with": {name: known[name] for name in self.measured.names if name in known} or None,
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class _Job:
    """How all films of one command are measured, and where what is found goes."""

    options: Options
    reading: Reading
    network: Network
    lake: Lake | None
    at: str | None
    branch: str
    commit: bool
    anyway: bool
    report: Path | None
    zarr: Path | None
    cache: Path | None

    def do(self, subject: Subject) -> _Done:
        """Measure one film; commit and write what is to be shown."""
        from flagdata.lake.results import placed
        from flagdata.outputs import fresh_folder, write_file
        from measure.commands.measured import artifact as artifact_of
        from measure.commands.measured import keep, write
        from measure.commands.measuring import run
        from measure.estimate.series import beside

        estimator = self.network.estimator
        with _advancing("measure", "window") as advance:
            measured = run(subject, self.network, self.options, advance=advance)
        wind = None if subject.record is None else subject.record.wind()
        series = beside(measured, start=subject.film.start, wind=wind)
        _warn(measured.noticed(anyway=self.anyway))
        shown = measured.shown(anyway=self.anyway)
        refinement = None
        if self.options.refine is not None and shown:
            from measure.estimate.refined import refined

            refinement = refined(measured, subject, estimator, budget=self.options.refine, cache=self.cache)
            _warn(refinement.findings)
        found = None if refinement is None else refinement.as_dict()
        lake = self.lake if self.commit and shown else None
        artifact = None
        if lake is not None:
            row = artifact_of(measured, subject, self.network, self.reading)
            artifact = placed(lake, row, branch=self.branch).artifact.id
        text = None
        if self.report is not None:
            text = self._page(measured, series, subject, artifact, refinement)
        published = False
        if lake is not None and artifact is not None:
            place = keep(
                lake, measured, subject, self.network, self.reading, series, branch=self.branch, refinement=found
            )
            published = place.new
            say(f"{artifact[:SHORT]}  measurement, {place.sentence}")

        def writing(what: str) -> AbstractContextManager[None]:
            return following(f"the measurement {artifact}", f"writing {what}") if published else nullcontext()

        if self.zarr is not None and shown:
            with writing("its Zarr folder"), fresh_folder(self.zarr) as scratch:
                write(scratch, measured, series, found)
        if self.report is not None and text is not None:
            with writing("its report"):
                write_file(self.report, text, command="measure")
                say(f"report: {self.report}")
        return _Done(measured=measured, series=series, artifact=artifact, subject=subject, refinement=refinement)

    def refuse(self, done: _Done) -> None:
        """Raises:
        RefusedError: the gate refused the film, and it is not to be shown anyway or there is nothing to measure.
        """
        verdict = done.measured.verdict
        if not done.measured.shown(anyway=self.anyway):
            where = done.measured.film + (f", see {self.report}" if self.report is not None else "")
            for reason in verdict.reasons[1:]:
                say(f"also: {reason.what}")
            raise RefusedError(
                verdict.sentence,
                where=where,
                fix=verdict.reasons[0].fix,
            )

    def _page(
        self,
        measured: Measurement,
        series: Beside,
        subject: Subject,
        artifact: str | None,
        refinement: Refinement | None,
    ) -> str:
        """The page of a report.

        Args:
            artifact: id of the measurement in the lake; None where it is not to be there.
        """
        from measure.estimate.nearest import nearest
        from measure.estimate.page import Context, Section, page
        from measure.estimate.pictures import steps
        from measure.refine.section import section

        model = self.network.estimator
        neighbours, compared = (), 0
        if self.lake is not None:
            with _advancing("simulated clips", "clip") as advance:
                neighbours, compared = nearest(
                    self.lake,
                    model,
                    measured.summary,
                    without=subject.recording,
                    at=self.at,
                    seed=self.options.seed,
                    advance=advance,
                )
        context = Context(
            provenance=self._provenance(subject, artifact),
            known=subject.known or {},
            neighbours=neighbours,
            compared=compared,
            rate=model.front_end.rate,
            steps=steps(subject.film),
            figures=subject.film.sentences,
        )
        sections = ()
        if refinement is not None:
            sections = (Section(anchor="refinement", title="Refined by simulation", body=section(refinement)),)
        return page(measured, series, context, anyway=self.anyway, sections=sections)

    def _provenance(self, subject: Subject, artifact: str | None) -> Mapping[str, str]:
        film = subject.film
        source = subject.content_hash() if subject.artifact is None else subject.artifact.id
        rows = {
            "film": f"{film.name}, {film.duration:.2f} s at {film.rate:.4g} frames a second",
            "source": f"SHA-256 {source}" if subject.artifact is None else f"{subject.artifact.kind} {source}",
            "network": self.network.described,
            "options": ", ".join(f"{k} {v}" for k, v in _given(self.options, self.reading).items()),
            "seed": str(self.options.seed),
        }
        return rows if artifact is None else {**rows, "artifact": artifact}


def _given(options: Options, reading: Reading) -> Mapping[str, Any]:
    return {k: v for k, v in {**options.recipe(), **reading.recipe()}.items() if v is not None}


def _several(job: _Job, found: Sequence[Subject], *, as_json: bool) -> None:
    done = [job.do(subject) for subject in found]
    shown = [one for one in done if one.measured.shown(anyway=job.anyway)]
    if as_json:
        document("measurements", {"measurements": [one.as_dict(anyway=job.anyway) for one in done]})
    else:
        for one in done:
            source = one.subject.artifact.id[:SHORT] if one.subject.artifact is not None else one.measured.film
            answer = one.measured.sentence if one in shown else f"refused: {one.measured.verdict.sentence}"
            echo(f"{source}  {answer}")
    if not shown:
        raise RefusedError(
            f"all {len(done)} clips are unlike what the network was trained on",
            where="--query",
            fix="look at one with --report, or at all with --anyway",
        )


def _warn(findings: Sequence[Finding]) -> None:
    for finding in findings:
        if finding.severity is not Severity.NOTE:
            say_finding(finding)


def _report(done: _Done, *, series: bool) -> None:
    from measure.estimate.answer import SHORT

    measured = done.measured
    mark = "refused by the gate, not to be relied on: " if measured.verdict.refused else ""
    echo(mark + measured.sentence)
    say(f"  {measured.verdict.sentence}; {measured.combined} of {len(measured.verdict.window_p)} windows in the answer")
    known = done.subject.known or {}
    if shown := [f"{SHORT[q.name]} {known[q.name]:.3g} {q.unit}" for q in measured.quantities if q.name in known]:
        say(f"  simulated with {', '.join(shown)}")
    for finding in measured.bounds:
        if finding.severity is Severity.NOTE:
            say(f"  {finding.what}; {finding.fix}")
    if done.refinement is not None:
        echo(f"{mark}refined: {done.refinement.sentence}")
    if not series:
        return
    for window in measured.windows:
        wind = window.quantity("wind_speed")
        value = f"{wind.value:6.2f} m/s " if wind.span.bound is None else ""
        echo(f"{window.start:9.2f} s  {value}{wind.span.phrase(2, ' m/s')}")
    for title, agreement in (("window", done.series.window), ("minute", done.series.of_minute)):
        if agreement is not None:
            say(f"  against the anemometer's {title} means: {agreement.sentence}")


@contextmanager
def _advancing(label: str, unit: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar whose length is given with the first step."""
    with ExitStack() as stack:
        steps: list[Callable[[int], None]] = []

        def advance(total: int, count: int) -> None:
            if not steps:
                steps.append(stack.enter_context(progress(total, label=label, unit=unit)))
            steps[0](count)

        yield advance
