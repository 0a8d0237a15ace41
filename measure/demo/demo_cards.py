"""What the demonstration shows of a step, and of what was hidden; its answer is made of these."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from markupsafe import Markup

from flagdata.answer.answer import Answer, Figure, Head, Part, Section, Table, Tone


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
        figure: that shows it; None for none.
        page: a page of the folder that has more; empty for none.
        commands: that were typed.
        seconds: that it took.
        truths: what the step sought, beside what it found.
    """

    title: str
    done: str
    found: str
    figure: Figure | None
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


_LIMITS = {
    Judgement.MISSED: "what was found does not hold the truth",
    Judgement.GIVEN: "typed by a person, as the recording does not show it",
    Judgement.UNDECIDED: "the recording cannot decide it",
    Judgement.REFUSED: "the step refused, and says why",
}
_SHOWN = 2  # figures on the first screen
_ABOUT = (
    "A flag was simulated on a mesh and in time steps that no later step uses. What is in no file "
    "was sought by the commands below, as for a recording of one's own."
)


def demonstration_answer(cards: Sequence[Card], *, seconds: float) -> Answer:
    """Returns how much of what no file states was found.

    Args:
        cards: of the steps, in their order.
        seconds: that all of it took.
    """
    truths = [truth for card in cards for truth in card.truths]
    figures = [card.figure for card in cards if card.figure is not None]
    shown = figures if len(figures) <= _SHOWN else [figures[0], figures[-1]]
    return Answer(
        question="demo",
        subject="A flag, a film and an anemometer",
        sentence=_sentence(truths),
        tone=_tone(truths),
        head=Head(
            figures=shown,
            facts={
                **({cards[0].title: cards[0].done} if cards else {}),
                "steps": str(len(cards)),
                "took": f"{seconds // 60:.0f} min {seconds % 60:.0f} s",
            },
            limits=[
                f"{truth.what[:1].upper()}{truth.what[1:]}: {_LIMITS[truth.judgement]}."
                for truth in truths
                if truth.judgement in _LIMITS
            ],
            remarks=[_ABOUT],
        ),
        make_sections=lambda: [*_sections(cards, truths, shown)],
    )


def _sentence(truths: Sequence[Truth]) -> str:
    judged = [one for one in truths if one.judgement not in (Judgement.OPEN, Judgement.GIVEN)]
    right = sum(truth.judgement is Judgement.RIGHT for truth in judged)
    if not judged:
        return "What no file states was sought, and stands beside the truth."
    if len(judged) == 1:
        (one,) = judged
        return f"What no file states was {'found' if right else 'not found'}: the {one.what}."
    verb = "was" if right == 1 else "were"
    return f"Of {len(judged)} things that no file states {right or 'none'} {verb} found."


def _tone(truths: Sequence[Truth]) -> Tone:
    judgements = {truth.judgement for truth in truths}
    if Judgement.MISSED in judgements:
        return Tone.MISSED
    return Tone.SETTLED if judgements <= {Judgement.RIGHT, Judgement.OPEN} else Tone.OPEN


def _sections(
    cards: Sequence[Card], truths: Sequence[Truth], shown: Sequence[Figure]
) -> Iterator[Section]:
    if truths:
        rows = [(one.what, one.true, one.found, one.judgement.value) for one in truths]
        yield Section(
            title="The truth beside what was found",
            parts=[Table(columns=("", "true", "found", ""), rows=rows)],
            anchor="truth",
        )
    for number, card in enumerate(cards, start=1):
        yield Section(
            title=f"{number}. {card.title}",
            parts=[*_parts(card, shown)],
            anchor=f"step-{number}",
            folded=True,
        )


def _parts(card: Card, shown: Sequence[Figure]) -> Iterator[Part]:
    yield card.done
    if card.figure is not None and card.figure not in shown:
        yield card.figure
    if card.found:
        yield Markup("<pre>{}</pre>").format(card.found)
    if card.page:
        yield Markup('<p><a href="{}">The page of this step</a></p>').format(card.page)
    if card.commands:
        typed = Markup("<br>").join(Markup("<code>{}</code>").format(one) for one in card.commands)
        yield Markup('<p class="small">{}</p>').format(typed)
    yield f"It took {card.seconds:.0f} s."
