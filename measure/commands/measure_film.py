"""One film through everything, for the command line and for Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flagdata.answer.measured import Answer, Measured, Windows
from flagdata.answer.wind_elsewhere import WindComparison, compare_winds
from flagdata.api.measuring_verbs import Measuring
from flagdata.core.findings import Finding, Severity
from flagdata.core.stated import Stated
from flagdata.core.workload import one_thread
from flagdata.dataset.lake_source import lake_of
from flagdata.errors import UsageError
from flagdata.ingest.films.film_array import Frames
from flagdata.lake import Lake
from measure.anemometer.anemometer_measuring import measure_by
from measure.anemometer.networks import Network, gate_beside, network
from measure.estimate.combine import of_model
from measure.estimate.film_measuring import Measurement, Options, measure
from measure.estimate.named_cloth import weight_of
from measure.film.film_source import FilmReading, Subject, size_of, subjects


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
    measurement = run(subject, network(chosen.model, lake=lake, at=chosen.at), request.options)
    verdict = measurement.verdict
    return Measured(
        film=measurement.film,
        rate=measurement.rate,
        duration=measurement.duration,
        network=measurement.model,
        refused=verdict.refused,
        verdict=verdict.sentence,
        reasons=tuple(
            Finding(
                kind=reason.kind,
                severity=Severity.WARNING,
                what=reason.what,
                fix=reason.fix,
                value=reason.value if reason.p is None else reason.p,
            )
            for reason in verdict.reasons
        ),
        findings=measurement.notices(anyway=chosen.anyway),
        figures=subject.film.as_dict(),
        given=answer_of(measurement) if measurement.shown(anyway=chosen.anyway) else None,
        elsewhere=wind_elsewhere(measurement, chosen),
    )


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


def answer_of(measurement: Measurement) -> Answer:
    """Returns what a film says, as arrays."""
    quantities = {quantity.name: quantity for quantity in measurement.quantities}
    rows = {
        name: [window.quantity(name) for window in measurement.windows]
        for name in measurement.names
    }
    nan = float("nan")
    windows = Windows(
        start=np.array([window.start for window in measurement.windows]),
        end=np.array([window.end for window in measurement.windows]),
        p=np.array([window.p for window in measurement.windows]),
        value={
            name: np.array([nan if q.value is None else q.value for q in by_window])
            for name, by_window in rows.items()
        },
        low={name: np.array([q.span.low for q in by_window]) for name, by_window in rows.items()},
        high={name: np.array([q.span.high for q in by_window]) for name, by_window in rows.items()},
    )
    draws = {name: measurement.draws[:, column] for column, name in enumerate(measurement.names)}
    return Answer(
        sentence=measurement.sentence,
        quantities=quantities,
        draws=draws,
        windows=windows,
        gusts=None if measurement.gusts is None else measurement.gusts.intensity,
    )
