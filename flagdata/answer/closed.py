"""What `flagdata.close_loop` returns: what the model of a cloth lacks, in words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from flagdata.answer.answer import Answer
from flagdata.answer.quantity import Quantity


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Closed(Answer):
    """A verdict. Its quantities are the strengths and the cloth's calibrated parameters.

    Attributes:
        conclusion: "no effect needed", "not decided", "effect", "one of", "partly explained", "none
            of the library" or "cannot test".
        named: the effect, or the effects that fit equally well; empty for none.
        words: the verdict as `flagdata close-loop --verbose` prints it.
        p_value: of the base model against simulated nulls.
        strengths: effect → its parameter, of those that were named, in its own unit.
    """

    conclusion: str
    named: tuple[str, ...]
    words: str
    p_value: float
    strengths: Mapping[str, Quantity] = field(default_factory=dict)
