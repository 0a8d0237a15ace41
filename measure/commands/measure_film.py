"""One film through everything, for the command line and for Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.answer import Array, Tone
from flagdata.answer.measured import DRAW, DRAWN, GUSTS, WINDOW, Measured
from flagdata.answer.wind_elsewhere import WindComparison, compare_winds
from flagdata.api.measuring_verbs import Measuring
from flagdata.core.json_values import json_values
from flagdata.core.stated import Stated
from flagdata.core.workload import one_thread
from flagdata.dataset.lake_source import lake_of
from flagdata.errors import UsageError
from flagdata.ingest.films.film_array import Frames
from flagdata.lake import Lake
from flagdata.timebase import NANOSECONDS
from measure.anemometer.anemometer_measuring import measure_by
from measure.estimate.combine import of_model
from measure.estimate.film_answer import SHORT, form_of, say
from measure.estimate.film_measuring import Measurement, Options, measure
from measure.estimate.measurement_page import FindNeighbours, make_head, make_sections
from measure.estimate.named_cloth import weight_of
from measure.estimate.wind_by_window import Beside, beside
from measure.film.film_source import FilmReading, Subject, size_of, subjects
from measure.measuring_model.networks import Network, gate_beside, network
from measure.refine.refinement import Refinement
from measure.refine.refinement_section import refinement_section


@one_thread()
def run(
    subject: Subject,
    network: Network,
    options: Options,
    *,
    advance: Callable[[int, int], None] | None = None,
) -> Measurement:
    """Measure one film by a network, with the gate and the dependence of windows that belong to it,
    or by a reading model.

    Args:
        advance: called after each window with how many there are and 1.

    Raises:
        FlagdataError: see `measure.estimate.film_measuring.measure`.
    """
    if network.reading is not None and network.artifact is not None:
        return measure_by(
            subject.film,
            network.reading,
            network.estimator,
            options,
            name=network.artifact.name,
            advance=advance,
        )
    gate = gate_beside(network, false_alarm=options.false_alarm)
    return measure(
        subject.film,
        network.estimator,
        gate=gate,
        dependence=of_model(network.estimator),
        options=options,
        advance=advance,
    )


def weight(
    area_weight: Stated | None, material: str | None, *, lake: Lake | None, at: str | None
) -> tuple[Stated | None, str | None]:
    """Returns the area weight that was given, by itself or by a material's name, and where the
    latter is from.

    Raises:
        UsageError: both were given.
        UnknownNameError: no such material.
    """
    if area_weight is not None and material is not None:
        raise UsageError(
            "the area weight is given twice", fix="choose one of --area-weight and --material"
        )
    return (area_weight, None) if material is None else weight_of(material, lake=lake, at=at)


@dataclass(frozen=True, kw_only=True, eq=False)
class Request:
    """What the options of a measurement ask for.

    Attributes:
        options: how films are measured.
        reading: how they are read.
        origin: where the area weight of a material is from; None where none was named.
    """

    options: Options
    reading: FilmReading
    origin: str | None

    @classmethod
    def of(
        cls, chosen: Measuring, *, lake: Lake | None, at: str | None, refine: int | None = None
    ) -> Request:
        """Reads the options.

        Args:
            refine: simulated clips of a refinement; None for none.

        Raises:
            FlagdataError: options that contradict each other, or values that no flag has.
        """
        area_weight = None if chosen.area_weight is None else Stated.of(chosen.area_weight)
        chosen_weight, origin = weight(area_weight, chosen.material, lake=lake, at=at)
        size = size_of(chosen.source, chosen.flag_size)
        options = Options(
            size=size,
            step=chosen.windows,
            first=chosen.start,
            last=chosen.end,
            level=chosen.level,
            false_alarm=chosen.false_alarm,
            seed=chosen.seed,
            refine=refine,
            area_weight=chosen_weight,
        )
        return cls(options=options, reading=FilmReading.of(chosen, size), origin=origin)


def measure_one(chosen: Measuring) -> Measured:
    """Measures one film from Python; see `flagdata.measure`.

    Raises:
        FlagdataError: see `flagdata.measure`.
    """
    lake = lake_of(chosen.lake)
    request = Request.of(chosen, lake=lake, at=chosen.at)
    (subject,) = _subjects(chosen.source, lake=lake, at=chosen.at, reading=request.reading)
    by = network(chosen.model, lake=lake, at=chosen.at)
    return answer_of(run(subject, by, request.options), subject, by, request, chosen, lake=lake)


def answer_of(
    measurement: Measurement,
    subject: Subject,
    by: Network,
    request: Request,
    chosen: Measuring,
    *,
    lake: Lake | None,
    refinement: Refinement | None = None,
    artifact: str | None = None,
    neighbours: FindNeighbours | None = None,
) -> Measured:
    """Returns what a film says, or why it is refused.

    Args:
        by: what measured it.
        lake: where the film is from; None where no lake was named.
        refinement: of the answer; None where none was asked for.
        artifact: id of the measurement in the lake; None where it is not to be there.
        neighbours: seeks the simulated clips nearest to the film, for the page.
    """
    verdict, anyway = measurement.verdict, chosen.anyway
    shown, rate = measurement.shown(anyway=anyway), by.estimator.front_end.rate
    wind = None if subject.record is None else subject.record.wind()
    series = beside(measurement, start=subject.film.start, wind=wind)
    elsewhere = wind_elsewhere(measurement, chosen)
    refined = () if refinement is None else (refinement_section(refinement),)
    quantities = {one.name: replace(one, form=form_of(one)) for one in measurement.quantities}
    if measurement.gusts is not None:
        quantities[GUSTS] = measurement.gusts.intensity
    tone = Tone.SETTLED if quantities["wind_speed"].constrained else Tone.OPEN
    return Measured(
        question="measure",
        subject=measurement.film,
        sentence=_sentence(measurement, anyway=anyway),
        tone=Tone.MISSED if verdict.refused else tone,
        quantities=quantities if shown else {},
        arrays=_arrays(measurement, series, subject.film.start) if shown else {},
        findings=measurement.notices(anyway=anyway),
        document=_document(
            measurement,
            series,
            subject,
            anyway=anyway,
            refinement=refinement,
            artifact=artifact,
            elsewhere=elsewhere,
        ),
        head=make_head(
            measurement,
            series,
            subject,
            anyway=anyway,
            rate=rate,
            circumstances=subject.circumstances(lake),
            elsewhere=elsewhere,
        ),
        make_sections=lambda: make_sections(
            measurement,
            series,
            subject,
            anyway=anyway,
            rate=rate,
            neighbours=neighbours,
            more=refined,
        ),
        provenance=_provenance(subject, by, request, artifact),
        film=measurement.film,
        rate=measurement.rate,
        duration=measurement.duration,
        network=measurement.model,
        refused=verdict.refused,
        verdict=verdict.sentence,
        reasons=tuple(reason.finding for reason in verdict.reasons),
        figures=subject.film.figures,
        elsewhere=elsewhere,
    )


def _sentence(measurement: Measurement, *, anyway: bool) -> str:
    verdict = measurement.verdict
    quantities = {quantity.name: quantity for quantity in measurement.quantities}
    if not verdict.refused:
        return say(quantities)
    if not measurement.shown(anyway=anyway):
        return f"Refused: {verdict.refusal}."
    said = say(quantities, weight=False)
    return f"Refused by the gate and not to be relied on: {said[:1].lower()}{said[1:]}"


def _document(
    measurement: Measurement,
    series: Beside,
    subject: Subject,
    *,
    anyway: bool,
    refinement: Refinement | None,
    artifact: str | None,
    elsewhere: WindComparison | None,
) -> Mapping[str, Any]:
    """Returns everything as JSON values."""
    truths = subject.known or {}
    simulated = {name: truths[name] for name in measurement.names if name in truths}
    shown = measurement.shown(anyway=anyway)
    more = {
        "series": series if shown else None,
        "source": None if subject.artifact is None else subject.artifact.id,
        "artifact": artifact,
        "refinement": refinement,
        "wind_elsewhere": elsewhere,
        "conditioning": subject.film.figures,
        "simulated_with": simulated or None,
    }
    return {**measurement.document(anyway=anyway), **json_values(more)}


def _arrays(measurement: Measurement, series: Beside, start: int | None) -> dict[str, Array]:
    """Returns draws, windows, and the anemometer beside them."""
    level = f"{100 * measurement.options.level:.3g} %"
    windows = measurement.windows
    starts = np.array([window.start for window in windows])
    ends = np.array([window.end for window in windows])
    place = partial(Array, dimensions=(WINDOW,), unit="s", coordinate=True)
    arrays = {
        "start": place(values=starts, about="first frame, since the first of the film"),
        "end": place(values=ends, about="last frame, since the first of the film"),
    }
    if start is not None:
        middles = start + np.round(series.time * NANOSECONDS).astype(np.int64)
        about = "middle of the window, UTC"
        arrays["time"] = place(values=middles.astype("datetime64[ns]"), unit="", about=about)
    along = partial(Array, dimensions=(WINDOW,))
    p = np.array([window.p for window in windows])
    arrays["p"] = along(values=p, about="probability that a familiar clip is at least as strange")
    for column, name in enumerate(measurement.names):
        unit = measurement.quantities[column].unit
        by_window = [window.quantity(name) for window in windows]
        values = np.array([np.nan if one.value is None else one.value for one in by_window])
        low, high = (np.array([one.interval[end] for one in by_window]) for end in (0, 1))
        title = SHORT[name]
        arrays |= {
            name: along(values=values, unit=unit, about=f"{title} of each window"),
            f"{name}_low": along(values=low, unit=unit, about=f"its lower end at {level}"),
            f"{name}_high": along(values=high, unit=unit, about=f"its upper end at {level}"),
            f"{name}{DRAWN}": Array(
                dimensions=(DRAW,),
                values=measurement.draws[:, column],
                unit=unit,
                about=f"{title} of the film, drawn from the joint posterior",
            ),
        }
    for name, about in (("anemometer", "over the window"), ("anemometer_minute", "minute mean")):
        if name in (columns := series.columns()):
            said = f"wind of the anemometer, {about}"
            arrays[name] = along(values=columns[name], unit="m/s", about=said)
    return arrays


def _provenance(
    subject: Subject, by: Network, request: Request, artifact: str | None
) -> dict[str, str]:
    source = (
        f"SHA-256 {subject.content_hash()}"
        if subject.artifact is None
        else f"{subject.artifact.kind} {subject.artifact.id}"
    )
    given = {**request.options.recipe(), **request.reading.recipe()}
    rows = {
        "source": source,
        "network": by.described,
        "options": ", ".join(f"{k} {v}" for k, v in given.items() if v is not None),
        "seed": str(request.options.seed),
    }
    return rows if artifact is None else {**rows, "artifact": artifact}


def wind_elsewhere(measurement: Measurement, chosen: Measuring) -> WindComparison | None:
    """Compares the measured wind with the one that was stated beside it; None where none was, or
    nothing is shown."""
    if chosen.wind is None or not measurement.shown(anyway=chosen.anyway):
        return None
    (wind,) = (quantity for quantity in measurement.quantities if quantity.name == "wind_speed")
    return compare_winds(
        measurement.draws[:, measurement.names.index("wind_speed")],
        Stated.of(chosen.wind),
        is_bound=wind.span.bound is not None,
        level=measurement.options.level,
        seed=measurement.options.seed,
    )


def _subjects(
    source: Path | str | Frames, *, lake: Lake | None, at: str | None, reading: FilmReading
) -> list[Subject]:
    if not isinstance(source, Frames):
        return subjects(str(source), query=None, lake=lake, at=at, reading=reading)
    if reading.true_fps is not None or reading.sequence_fps is not None:
        raise UsageError(
            "frames of an array have their times",
            where="true_fps, sequence_fps",
            fix="leave the options out",
        )
    return [Subject(film=reading.conditioned(source))]
