"""The fitter that is graded."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from measure.loop.verdict import Verdict
from measure.observe.trajectory import Experiment


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
        from measure.loop.close import Options, close_loop

        return close_loop(experiment, Options(seed=seed, bank=self.bank))
