"""A flag weighed, and made an anemometer: what `flagdata.calibrate` returns and the command
prints."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.api.measuring_verbs import Calibrating
from flagdata.core.console import following, progress, say, say_finding
from flagdata.core.findings import Severity
from flagdata.core.printable import SHORT
from flagdata.core.shell import command_line
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.examples import check_without_lake
from flagdata.verbs.verb_options import described_fields, typed_names

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from flagdata.answer import Section
    from flagdata.answer.calibrated import Calibrated
    from flagdata.lake import Artifact, Lake
    from measure.anemometer.making import Made
    from measure.cloth.calibration_result import Calibration
    from measure.cloth.flag_recordings import Sources
    from measure.film.film_source import FilmReading
    from measure.film.similarity import FlagSize


@dataclass(frozen=True, kw_only=True, eq=False)
class Weighing:
    """A flag that was weighed, before it is kept in the lake.

    Attributes:
        calibration: what it is.
        reading: how films were read.
        parents: ids of the recordings in the lake.
        lake: in which it is kept; None where it is not to be there.
        branch: of the lake.
    """

    calibration: Calibration
    reading: FilmReading
    parents: tuple[str, ...]
    lake: Lake | None
    branch: str

    @property
    def row(self) -> Artifact | None:
        """Its place in the lake; None where it is not to be there."""
        if self.lake is None:
            return None
        from flagdata.lake.results import place_result
        from measure.cloth.calibration_artifact import artifact

        wanted = artifact(self.calibration, self.reading, self.parents)
        return place_result(self.lake, wanted, branch=self.branch).artifact

    def keep(self) -> str | None:
        """Commits it; returns the id where it is new."""
        if self.lake is None:
            return None
        from measure.cloth.calibration_artifact import keep

        placed = keep(self.lake, self.calibration, self.reading, self.parents, branch=self.branch)
        say(f"{placed.artifact.id[:SHORT]}  measurement, {placed.sentence}")
        return placed.artifact.id if placed.new else None


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedFlag:
    """What was made of recordings of a flag or of drapes.

    Attributes:
        answer: what is returned.
        weighing: None where the cloth of a flag was not weighed.
        anemometer: id of the reading model that was made alone.
    """

    answer: Calibrated
    weighing: Weighing | None = None
    anemometer: str | None = None

    def keep(self) -> AbstractContextManager[None]:
        """Commits the weight; returns a context in which an error of what follows is a warning,
        where something is new in the lake."""
        weight = None if self.weighing is None else self.weighing.keep()
        if weight is not None:
            return following(f"the calibration {weight}", "writing its report")
        if self.anemometer is not None:
            return following(f"the reading model {self.anemometer}", "writing its report")
        return nullcontext()


def calibrate_recordings(chosen: Calibrating) -> Calibrated:
    """Calibrates a flag or drapes from Python; see `flagdata.calibrate`.

    Raises:
        FlagdataError: see `flagdata.calibrate`.
    """
    check_options(chosen)
    done = calibrate_flag(chosen, workers=chosen.workers)
    done.keep()
    return done.answer


_OF_WEIGHT = {
    "attachment",
    "azimuth_deg",
    "elevation_deg",
    "distance",
    "material",
    "log",
    "clock_offset",
    "simulations",
    "workers",
    "cache",
    "seed",
}


_OF_DRAPES = {
    "recordings",
    "area_weight",
    "simulations",
    "level",
    "seed",
    "workers",
    "cache",
    "as_json",
    "report",
}


def check_options(chosen: Calibrating) -> None:
    """Checks what was asked for, before anything is loaded that takes long.

    Raises:
        InputError: no recordings.
        NotFoundError: a recording that is no file, without a lake.
        UsageError: options of what is not to be done, or no size of a flag.
    """
    if not _sources(chosen):
        raise InputError("no recordings are given", where="recordings", fix="give at least one")
    ignored = {"weight": {"name", "model"}, "anemometer": _OF_WEIGHT}.get(chosen.only or "", set())
    fields = described_fields(type(chosen))
    if chosen.area_weight is not None:
        ignored = set(fields) - _OF_DRAPES
    other = (
        "--area-weight" if chosen.area_weight is not None else command_line("--only", chosen.only)
    )
    for name in sorted(ignored & typed_names(chosen)):
        spelled = fields[name][1].spelling_of(name)
        raise UsageError(
            f"{spelled} cannot be combined with {other}", where=spelled, fix=f"leave {spelled} out"
        )
    if chosen.area_weight is not None:
        return
    if chosen.flag_size is None:
        raise UsageError(
            "the flag's size is missing: windows are as long as its size requires",
            where="--flag-size",
            fix="give length x height in metres, as in 1.5x1.0",
        )
    if chosen.lake is None:
        named = [one for one in _sources(chosen) if isinstance(one, Path | str)]
        check_without_lake(*named)


def calibrate_flag(chosen: Calibrating, *, workers: int) -> CalibratedFlag:
    """Finds what was asked for: the cloth of drapes, or of a flag, and its reading model. The
    latter is kept in the lake, the former by `keep`.

    Args:
        workers: processes that simulate.

    Raises:
        FlagdataError: see `flagdata.calibrate`.
    """
    if chosen.area_weight is not None:
        return CalibratedFlag(answer=_answer_drapes(chosen, workers=workers))
    from measure.cloth.calibrate_call import sources_of
    from measure.film.film_source import FilmReading
    from measure.film.similarity import FlagSize

    lake = chosen.opened()
    size = FlagSize.of(chosen.flag_size or "")
    reading = FilmReading.of(chosen, size)
    weighable = anemometer = None
    if chosen.only != "anemometer":
        weighable = sources_of(_sources(chosen), chosen, size, lake, at=chosen.version)
    if chosen.only != "weight":
        anemometer = _anemometer(chosen, size, reading, lake)
    if weighable is not None:
        weighing = _weigh(chosen, weighable, size, reading, lake, workers=workers)
        answer = _answer_weight(weighing, anemometer)
        return CalibratedFlag(answer=answer, weighing=weighing)
    from measure.anemometer.reading_answer import answer_of_reading

    assert anemometer is not None  # noqa: S101  it was asked for, and made or refused
    return CalibratedFlag(answer=answer_of_reading(anemometer), anemometer=anemometer.artifact)


def _sources(chosen: Calibrating) -> list[Mapping[str, ArrayLike] | Path | str]:
    several = chosen.recordings
    return [several] if isinstance(several, Mapping | Path | str) else list(several)


def _answer_drapes(chosen: Calibrating, *, workers: int) -> Calibrated:
    from measure.drape.drape_answer import answer_of_drapes, read_drapes

    with progress(chosen.simulations, label="drape", unit="drape") as advance:
        return answer_of_drapes(read_drapes(chosen, workers=workers, advance=advance))


def _weigh(
    chosen: Calibrating,
    sources: Sources,
    size: FlagSize,
    reading: FilmReading,
    lake: Lake | None,
    *,
    workers: int,
) -> Weighing:
    """Observes the recordings, simulates flags for each and weighs the cloth."""
    from measure.cloth.calibrate_call import folder_of, options_of
    from measure.cloth.cloth_calibration import calibrate
    from measure.cloth.design import announce_simulations
    from measure.cloth.numerics import FLAGS, LASTING, effort

    drawn = {"simulations": chosen.simulations, "level": chosen.level, "seed": chosen.seed}
    options = options_of(chosen, size, **drawn)
    with progress(None, label="observe", unit="window") as advance:
        gathered = sources.read(size, advance=advance)
    observed = gathered.recordings
    work = sum(
        options.simulations * recording.duration + effort(recording.duration)
        for recording in observed
    )
    say(announce_simulations(work, workers=workers))
    seconds = sum(
        options.simulations * recording.duration + FLAGS * min(LASTING, recording.duration)
        for recording in observed
    )
    with progress(round(seconds), label="calibrate", unit="flag-second") as advance:
        calibration = calibrate(
            observed,
            options,
            folder=folder_of(chosen),
            workers=workers,
            left_out=gathered.left_out,
            advance=advance,
        )
    return Weighing(
        calibration=calibration,
        reading=reading,
        parents=gathered.parents,
        lake=None if chosen.read_only else lake,
        branch=chosen.branch,
    )


def _answer_weight(weighing: Weighing, anemometer: Made | None) -> Calibrated:
    from measure.cloth.calibration_answer import answer_of_calibration

    row = weighing.row
    wanted = None if row is None else row.id
    return answer_of_calibration(
        weighing.calibration,
        artifact=wanted,
        others=_sections(anemometer),
        further={
            "artifact": wanted,
            "anemometer": None if anemometer is None else anemometer.document,
        },
    )


def _anemometer(
    chosen: Calibrating, size: FlagSize, reading: FilmReading, lake: Lake | None
) -> Made | None:
    """Makes the reading model; returns None with the reason on stderr where none can be made and
    the weight was asked for as well."""
    from measure.anemometer.making import made
    from measure.cloth.flag_recordings import is_table

    sources = _sources(chosen)
    named = [str(one) for one in sources if isinstance(one, Path | str)]
    if len(named) < len(sources) or any(is_table(source) for source in named):
        if chosen.only is None and chosen.name is None and chosen.model is None:
            return None
        raise UsageError(
            "a table of observables has no pictures, which a reading model takes",
            where="RECORDING",
            fix="name recordings of a lake, or give --only weight",
        )
    try:
        with progress(None, label="read", unit="window") as advance:
            done = made(
                named,
                size,
                reading,
                name=chosen.name,
                model=chosen.model,
                lake=lake,
                at=chosen.version,
                branch=None if chosen.read_only else chosen.branch,
                first=chosen.start or 0.0,
                last=chosen.end,
                level=chosen.level,
                advance=advance,
            )
    except (InputError, RefusedError) as error:
        if chosen.only is not None:
            raise
        say(f"no reading model: {error.what}" + (f"; {error.fix}" if error.fix else ""))
        return None
    say(f"the flag as an anemometer {done.result.sentence}")
    for finding in done.result.findings:
        if finding.severity is not Severity.NOTE:
            say_finding(finding)
    if done.placed is not None:
        say(f"{done.placed.artifact.id[:SHORT]}  reading model, {done.placed.sentence}")
        say(f"for flagdata measure: {command_line('--model', done.name)}")
    return done


def _sections(anemometer: Made | None) -> tuple[Section, ...]:
    if anemometer is None:
        return ()
    from measure.anemometer.reading_answer import reading_section

    return (reading_section(anemometer.result),)
