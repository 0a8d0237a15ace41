"""What the demonstration's first page shows of a step, and of what was hidden."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Judgement(StrEnum):
    """What a finding is beside its truth; the page shows the words."""

    RIGHT = "right"
    """It was inferred, and its interval or its names hold the truth."""
    MISSED = "missed"
    """It was inferred, and does not hold the truth."""
    GIVEN = "given"
    """It was typed by a person, not inferred."""
    UNDECIDED = "not decided"
    """The step states that the recording cannot decide it."""
    REFUSED = "refused"
    """The step gave no value, and why."""
    OPEN = ""
    """It is not judged."""


@dataclass(frozen=True, kw_only=True)
class Card:
    """A step.

    Attributes:
        title: of the step.
        done: what was done, in a sentence or two.
        found: what came out, as the command printed it; empty where nothing is to be said.
        picture: a data URL; empty for none.
        alt: what the picture shows.
        page: a page of the folder that has more; empty for none.
        commands: that were typed.
        seconds: that it took.
        truths: what the step sought, beside what it found.
    """

    title: str
    done: str
    found: str
    picture: str
    alt: str
    page: str
    commands: tuple[str, ...]
    seconds: float
    truths: tuple[Truth, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Something that no file states, beside what was found.

    Attributes:
        what: it is.
        true: its value.
        found: what the steps gave.
        judgement: whether that holds.
    """

    what: str
    true: str
    found: str
    judgement: Judgement
