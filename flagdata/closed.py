"""What `flagdata.close_loop` returns: what the model of a cloth lacks, in words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagdata import html


@dataclass(frozen=True, kw_only=True)
class Strength:
    """The strength of an effect that was named, with its interval, in the effect's own unit.

    Attributes:
        bound: "at-least" or "at-most" where it is known on one side only, and `value` is that bound; "nothing" where it
            is not determined; None of an interval with two ends.
    """

    parameter: str
    value: float
    low: float
    high: float
    unit: str
    level: float
    bound: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Closed:
    """A verdict.

    Attributes:
        conclusion: "no effect needed", "not decided", "effect", "one of", "partly explained", "none of the library" or
            "cannot test".
        named: the effect, or the effects that fit equally well; empty for none.
        sentence: the verdict in one line.
        words: the verdict as `flagdata close-loop` prints it.
        p_value: of the base model against simulated nulls.
        strengths: effect → strength, of those that were named.
        document: all numbers, as the command writes them to verdict.json.
        page: the report, HTML that refers to no other file.
    """

    conclusion: str
    named: tuple[str, ...]
    sentence: str
    words: str
    p_value: float
    strengths: Mapping[str, Strength]
    document: Mapping[str, Any]
    page: str

    def save(self, path: Path | str) -> Path:
        """Write the report to a file, in place of an earlier report there. Returns its path.

        Raises:
            ConflictError: something else is there.
            FlagdataError: it cannot be written.
        """
        from flagdata.outputs import write_file

        write_file(Path(path), self.page, command="close-loop")
        return Path(path)

    def __repr__(self) -> str:
        return self.words

    def _repr_html_(self) -> str:
        effects = {
            name: f"{fit.parameter} {fit.value:.3g} [{fit.low:.3g}, {fit.high:.3g}] {fit.unit}, {fit.level:.0%}"
            for name, fit in self.strengths.items()
        }
        return html.table(
            self.sentence, {"p of the base model": f"{self.p_value:.3g}", **effects, "verdict": self.words}
        )
