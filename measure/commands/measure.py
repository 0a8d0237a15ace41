"""`flagdata measure`: wind and cloth of a film, with intervals, or the reason why not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from flagdata.api.measuring_verbs import Measuring
from flagdata.core.console import (
    LocalPath,
    csv_rows,
    document,
    echo,
    following,
    progress,
    say,
    say_finding,
)
from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.core.printable import SHORT
from flagdata.errors import RefusedError, UsageError
from flagdata.examples import check_without_lake
from flagdata.verbs.shared_options import FILM, HOW, WRITTEN, Keeping
from flagdata.verbs.verb_options import AsJson, argument, command, option, options

if TYPE_CHECKING:
    from flagdata.answer.measured import Measured
    from flagdata.lake import Lake
    from measure.commands.measure_film import Request
    from measure.estimate.film_measuring import Measurement
    from measure.estimate.nearest import Neighbour
    from measure.estimate.wind_by_window import Beside
    from measure.film.film_source import Subject
    from measure.measuring_model.networks import Network
    from measure.refine.refinement import Refinement


@options
class MeasureCommand(AsJson, Measuring, Keeping):
    """The same on the command line: which of a lake's clips, what is refined, and what is
    written."""

    source: str | None = argument(  # pyright: ignore[reportIncompatibleVariableOverride]
        "The film; see `flagdata.measure`.", "[SOURCE]", default=None
    )
    query: str | None = option(
        'SQL condition over clips, instead of SOURCE: "wind between 3 and 6".',
        default=None,
        section=FILM,
        metavar="EXPR",
    )
    refine: int | None = option(
        "Refine the first window that counts by N simulated clips, 20 or more; 50 take minutes.",
        default=None,
        section=HOW,
        type=click.IntRange(min=20),
        metavar="N",
    )
    cache: Path | None = option(
        "Where simulated clips are kept, so that an interrupted refinement goes on.",
        default=None,
        section=HOW,
        type=LocalPath(),
        metavar="FOLDER",
    )
    report: Path | None = option(
        "Write a page that needs no other.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FILE.html",
    )
    zarr: Path | None = option(
        "Write draws and windows as a Zarr data set.",
        default=None,
        section=WRITTEN,
        type=LocalPath(),
        metavar="FOLDER",
    )
    as_csv: bool = option(
        "The windows as comma-separated values on stdout.", "--csv", default=False, section=WRITTEN
    )


@command(MeasureCommand)
def measure(chosen: MeasureCommand) -> None:
    """Measure wind and area weight from a film of a flag, with intervals.

    SOURCE is a video file, a folder of images, a recording, clip or camera of --lake by its name or
    id, or the film that comes with the package, example:flag, whose truth is printed beside. A gate
    looks first: a film unlike those the network was trained on is refused with the reason, exit
    code 3, and nothing estimated is shown. The windows of a longer film count as one gusty wind:
    the answer states the gusts' intensity, standard deviation over mean, too. With --lake the
    measurement becomes an artifact; the same one by the same code again adds nothing.

    \b
      flagdata measure example:flag
      flagdata measure clip.mp4 --flag-size 1.5x1.0 --report clip.html
      flagdata measure recording-7 --lake lake --windows 1.2s --csv
      flagdata measure --lake lake --query "wind between 3 and 6" --json
    """
    if chosen.as_json and chosen.as_csv:
        raise UsageError(
            "more than one form of output is given", fix="choose one of --json and --csv"
        )
    if chosen.cache is not None and chosen.refine is None:
        raise UsageError("--cache needs --refine", fix="give --refine N, or leave --cache out")
    from flagdata.core.files.outputs import check_file, check_folder

    if chosen.report is not None:
        check_file(chosen.report, command="measure")
    if chosen.zarr is not None:
        check_folder(chosen.zarr)
    if chosen.source is not None and chosen.lake is None:
        check_without_lake(chosen.source)
    from measure.commands.measure_film import Request
    from measure.film.film_source import subjects
    from measure.measuring_model.networks import network

    lake, at = chosen.opened(), chosen.version
    request = Request.of(chosen, lake=lake, at=at, refine=chosen.refine)
    weight = request.options.area_weight
    if weight is not None and request.origin is not None:
        say(f"area weight {weight.text} kg/m² of {chosen.material}: {request.origin}")
    clips = subjects(chosen.source, query=chosen.query, lake=lake, at=at, reading=request.reading)
    job = _Job(
        chosen=chosen,
        request=request,
        network=network(chosen.model, lake=lake, at=at),
        lake=lake,
        at=at,
    )
    if chosen.query is not None:
        if (
            chosen.report is not None
            or chosen.zarr is not None
            or chosen.as_csv
            or chosen.refine is not None
        ):
            raise UsageError(
                "a page, a Zarr, a CSV or a refinement is of one film",
                fix="measure one clip by its id, or use --json",
            )
        _several(job, clips)
        return
    done = job.do(clips[0])
    job.refuse(done)
    if chosen.as_json:
        document("measure", done.answer.document)
    elif chosen.as_csv:
        csv_rows(done.series.rows())
    else:
        _report(done, series=chosen.windows is not None)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Done:
    measured: Measurement
    series: Beside
    subject: Subject
    refinement: Refinement | None
    answer: Measured


@dataclass(frozen=True, kw_only=True, eq=False)
class _Job:
    """How all films of one command are measured, and where what is found goes."""

    chosen: MeasureCommand
    request: Request
    network: Network
    lake: Lake | None
    at: str

    def do(self, subject: Subject) -> _Done:
        """Measure one film; commit and write what is to be shown."""
        from flagdata.core.files.outputs import write_file
        from flagdata.lake.results import place_result
        from measure.commands.measure_film import answer_of, run
        from measure.commands.measurement_artifact import artifact as artifact_of
        from measure.commands.measurement_artifact import keep
        from measure.estimate.wind_by_window import beside

        estimator = self.network.estimator
        with _advancing(("search", "frame"), ("measure", "window")) as (
            subject.film.searched,
            advance,
        ):
            measured = run(subject, self.network, self.request.options, advance=advance)
        subject.film.searched = None
        wind = None if subject.record is None else subject.record.wind()
        series = beside(measured, start=subject.film.start, wind=wind)
        _warn(measured.notices(anyway=self.chosen.anyway))
        reported = measured.shown(anyway=self.chosen.anyway)
        refinement = None
        if self.request.options.refine is not None and reported:
            from measure.estimate.refined import refine_window

            refinement = refine_window(
                measured,
                subject,
                estimator,
                budget=self.request.options.refine,
                cache=self.chosen.cache,
            )
            _warn(refinement.findings)
        refinement_values = json_values(refinement)
        lake = None if self.chosen.read_only or not reported else self.lake
        artifact = None
        if lake is not None:
            row = artifact_of(measured, subject, self.network, self.request.reading)
            artifact = place_result(lake, row, branch=self.chosen.branch).artifact.id
        answer = answer_of(
            measured,
            subject,
            self.network,
            self.request,
            self.chosen,
            lake=self.lake,
            refinement=refinement,
            artifact=artifact,
            neighbours=None if self.lake is None else partial(self._nearest, measured, subject),
        )
        text = None if self.chosen.report is None else answer.page
        published = False
        if lake is not None and artifact is not None:
            placed_row = keep(
                lake,
                measured,
                subject,
                self.network,
                self.request.reading,
                series,
                branch=self.chosen.branch,
                refinement=refinement_values,
            )
            published = placed_row.new
            say(f"{artifact[:SHORT]}  measurement, {placed_row.sentence}")

        def writing(written: str) -> AbstractContextManager[None]:
            return (
                following(f"the measurement {artifact}", f"writing {written}")
                if published
                else nullcontext()
            )

        if self.chosen.zarr is not None and reported:
            with writing("its Zarr folder"):
                answer.save_zarr(self.chosen.zarr)
        if self.chosen.report is not None and text is not None:
            with writing("its report"):
                write_file(self.chosen.report, text, command="measure")
                say(f"report: {self.chosen.report}")
        return _Done(
            measured=measured,
            series=series,
            subject=subject,
            refinement=refinement,
            answer=answer,
        )

    def refuse(self, done: _Done) -> None:
        """Raises:
        RefusedError: the gate refused the film, and it is not to be shown anyway or there is
        nothing to measure.
        """
        verdict = done.measured.verdict
        if not done.measured.shown(anyway=self.chosen.anyway):
            where = done.measured.film + (
                f", see {self.chosen.report}" if self.chosen.report is not None else ""
            )
            for reason in verdict.reasons[1:]:
                say(f"also: {reason.what}")
            raise RefusedError(
                verdict.sentence,
                where=where,
                fix=verdict.reasons[0].fix,
            )

    def _nearest(self, measured: Measurement, subject: Subject) -> tuple[Sequence[Neighbour], int]:
        """Seeks the simulated clips of the lake nearest to a film, among so many."""
        from measure.estimate.nearest import nearest

        if self.lake is None:
            return (), 0
        with _advancing(("simulated clips", "clip")) as (advance,):
            return nearest(
                self.lake,
                self.network.estimator,
                measured.summary,
                without=subject.recording,
                at=self.at,
                seed=self.request.options.seed,
                advance=advance,
            )


def _several(job: _Job, clips: Sequence[Subject]) -> None:
    done = [job.do(subject) for subject in clips]
    reported = [result for result in done if result.measured.shown(anyway=job.chosen.anyway)]
    if job.chosen.as_json:
        document(
            "measurements",
            {"measurements": [result.answer.document for result in done]},
        )
    else:
        for result in done:
            source = (
                result.subject.artifact.id[:SHORT]
                if result.subject.artifact is not None
                else result.measured.film
            )
            answer = (
                result.measured.sentence
                if result in reported
                else f"refused: {result.measured.verdict.sentence}"
            )
            echo(f"{source}  {answer}")
    if not reported:
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
    from measure.estimate.film_answer import FORMS

    measured = done.measured
    mark = "refused by the gate, not to be relied on: " if measured.verdict.refused else ""
    echo(mark + measured.sentence)
    if measured.gusts is not None:
        echo(f"  {measured.gusts.sentence}")
    left_out = (
        ""
        if measured.combined == len(measured.verdict.window_p)
        else "; the others look unfamiliar or overlap"
    )
    say(f"  {measured.verdict.sentence}; the answer combines {measured.combined}{left_out}")
    truths = done.subject.known or {}
    if simulated_with := [
        f"{form.title} {form.convert(truths[name]):.3g}{form.suffix}"
        for name, form in FORMS.items()
        if name in truths and name in measured.names
    ]:
        say(f"  simulated with {', '.join(simulated_with)}")
    for finding in measured.bounds:
        if finding.severity is Severity.NOTE:
            say(f"  {finding.what}; {finding.fix}")
    if (elsewhere := done.answer.elsewhere) is not None:
        echo(f"  {elsewhere.sentence}")
        say(f"  {elsewhere.advice}")
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
    if done.series.spectrum is not None:
        say(f"  {done.series.spectrum.sentence}")


@contextmanager
def _advancing(*bars: tuple[str, str]) -> Iterator[list[Callable[[int, int], None]]]:
    """Shows progress bars, each a label and a unit, one after another: each begins with its first
    step, which gives its length, and ends the one before."""
    with ExitStack() as stack:
        current: dict[str, Callable[[int], None]] = {}

        def stepping(label: str, unit: str) -> Callable[[int, int], None]:
            def advance(total: int, count: int) -> None:
                if label not in current:
                    stack.close()
                    current.clear()
                    current[label] = stack.enter_context(progress(total, label=label, unit=unit))
                current[label](count)

            return advance

        yield [stepping(label, unit) for label, unit in bars]
