"""What `flagdata.close_loop` returns: what the model of a cloth lacks, in words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flagdata.answer import Quantity
from flagdata.core import html


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Closed:
    """A verdict.

    Attributes:
        conclusion: "no effect needed", "not decided", "effect", "one of", "partly explained", "none
            of the library" or "cannot test".
        named: the effect, or the effects that fit equally well; empty for none.
        sentence: the verdict in one line.
        words: the verdict as `flagdata close-loop` prints it.
        p_value: of the base model against simulated nulls.
        strengths: effect → its parameter, of those that were named, in its own unit.
        document: all numbers, as the command writes them to verdict.json.
        page: the report, HTML that refers to no other file.
    """

    conclusion: str
    named: tuple[str, ...]
    sentence: str
    words: str
    p_value: float
    strengths: Mapping[str, Quantity]
    document: Mapping[str, Any]
    page: str

    def save(self, path: Path | str) -> Path:
        """Write the report to a file, in place of an earlier report there. Returns its path.

        Raises:
            ConflictError: something else is there.
            FlagdataError: it cannot be written.
        """
        from flagdata.core.files.outputs import write_file

        write_file(Path(path), self.page, command="close-loop")
        return Path(path)

    def __repr__(self) -> str:
        return self.words

    def _repr_html_(self) -> str:
        effects = {
            name: f"{strength.name} {strength.text_with_level}"
            for name, strength in self.strengths.items()
        }
        return html.table(
            self.sentence,
            {"p of the base model": f"{self.p_value:.3g}", **effects, "verdict": self.words},
        )
