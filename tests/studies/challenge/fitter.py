"""The fitter that is graded."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from measure.trajectories import Experiment
from measure.verdict import CRITERIA, Verdict
from tests.studies.challenge.films import Filmed

if TYPE_CHECKING:
    from measure.cloth import FilmLoopOptions


@dataclass(frozen=True, kw_only=True)
class ClosingTheLoop:
    """`flagdata close-loop`, as a user runs it.

    Attributes:
        bank: folder with the simulated nulls of each design; None to simulate them anew for each
            experiment.
    """

    bank: Path | None = None

    def __call__(self, experiment: Experiment, seed: int) -> Verdict:
        """The verdict.

        Raises:
            InputError: the data do not do.
            NotFoundError: the folder has no nulls of this design.
        """
        from measure.closing import close_loop
        from measure.loop import LoopOptions
        from tests.studies.challenge.nulls import design_of

        bank = None if self.bank is None else self.bank / design_of(experiment)
        return close_loop(experiment, LoopOptions(seed=seed, bank=bank))


@dataclass(frozen=True, kw_only=True)
class ClosingTheLoopOnFilms:
    """`flagdata close-loop` on films, as a user runs it.

    Attributes:
        folder: where simulations are kept, which all sets share.
        simulations: of the base model for each recording; None for as many as the program takes.
        kinds: of numerics among null experiments.
        workers: processes that simulate.
    """

    folder: Path
    simulations: int | None = None
    kinds: int = CRITERIA.film_kinds
    workers: int = 1

    def __call__(self, given: Filmed, seed: int) -> Verdict:
        """The verdict. Simulations are drawn from one seed for all sets, so that they share them,
        and not from `seed`.

        Raises:
            FlagdataError: films that do not do.
        """
        del seed
        from measure.cloth import close_loop

        shown, left_out = given.observed()
        verdict = close_loop(shown, self.options(given), folder=self.folder, workers=self.workers)
        return replace(verdict, findings=(*left_out, *verdict.findings))

    def options(self, given: Filmed) -> FilmLoopOptions:
        """How a set is judged, by what is stated of it."""
        from measure.cloth import CalibrationOptions, FilmLoopOptions, simulations_of

        calibration = CalibrationOptions(
            flag=given.flag,
            azimuth=given.azimuth,
            elevation=given.elevation,
            distance=given.distance,
            simulations=self.simulations or simulations_of(len(given.recordings)),
        )
        return FilmLoopOptions(
            calibration=calibration, kinds=self.kinds, area_weight=given.area_weight
        )
