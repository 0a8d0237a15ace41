"""What the demonstration's first page shows of a step, and of what was hidden."""

from __future__ import annotations

from dataclasses import dataclass


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
    """

    title: str
    done: str
    found: str
    picture: str
    alt: str
    page: str
    commands: tuple[str, ...]
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Truth:
    """Something that no file states, beside what was found.

    Attributes:
        what: it is.
        true: its value.
        found: what the steps gave.
        right: whether that holds; None where it is not judged.
    """

    what: str
    true: str
    found: str
    right: bool | None
