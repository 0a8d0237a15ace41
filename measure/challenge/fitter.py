"""The fitter that is graded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from measure.observe.trajectory import Experiment
from measure.verdict.record import Verdict


@dataclass(frozen=True, kw_only=True)
class ClosingTheLoop:
    """`flagdata close-loop`, as a user runs it.

    Attributes:
        bank: folder of simulated nulls that several experiments share; None to simulate them anew for each.
    """

    bank: Path | None = None

    def __call__(self, experiment: Experiment, seed: int) -> Verdict:
        """The verdict.

        Raises:
            InputError: the data do not do.
        """
        from measure.closing.close import close_loop
        from measure.loop.run import Options

        return close_loop(experiment, Options(seed=seed, bank=self.bank))
