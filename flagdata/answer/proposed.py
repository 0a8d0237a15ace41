"""What `flagdata.propose` returns: an effect that the library lacks, kept or rejected."""

from __future__ import annotations

from dataclasses import dataclass

from flagdata.answer.answer import Answer


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Proposed(Answer):
    """A search for an effect. Its quantities are the strengths of what was taken.

    Attributes:
        decision: "kept" or "rejected".
        reason: why.
        effect: file and class of the effect; empty where no term was taken.
        words: the outcome as `flagdata propose` prints it.
    """

    decision: str
    reason: str
    effect: str
    words: str
