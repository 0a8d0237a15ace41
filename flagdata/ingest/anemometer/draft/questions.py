"""Open facts of a draft: what only the user can answer, and how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.errors import ErrorKind, RefusedError


@dataclass(frozen=True, kw_only=True)
class Open:
    """A question that only the user can answer.

    Attributes:
        key: the option that answers it.
        question: in words.
        example: the text behind the option; never an answer, but for the key of a check.
        lines: to be added to a recipe, where only a recipe answers it.
    """

    key: str
    question: str
    example: str
    lines: str = ""

    def fix(self) -> str:
        """Returns the option that answers the question."""
        if self.lines:
            return (
                "save the recipe that flagdata ingest --sniff prints as FILE.toml, replace each ? "
                "in it, and add"
                f"\n{self.lines}\nfor the one to be read; then name it: --sensor FILE.toml"
            )
        return (
            f"--{self.key.replace('_', '-')} "
            f"{self.example}{' (if yes)' if self.key == 'expect' else ''}"
        )


ZONE = Open(
    key="zone",
    question="what is the zone of the logger's clock (Europe/Amsterdam, +02:00, UTC)?",
    example="ZONE",
)


class OpenFactsError(RefusedError):
    """A draft with questions that nobody has answered."""

    kind = ErrorKind.OPEN_FACTS

    def __init__(
        self, what: str, *, where: str | None = None, fix: str, questions: tuple[Open, ...] = ()
    ) -> None:
        super().__init__(what, where=where, fix=fix)
        self.questions = questions

    @classmethod
    def of(cls, questions: Sequence[Open], *, where: str) -> OpenFactsError:
        """Returns the error for some questions, which names what answers each."""
        recipes = [question.fix() for question in questions if question.lines]
        options = (
            f"answer by {' '.join(question.fix() for question in questions)}; or describe the file "
            "by a recipe: "
        )
        return cls(
            f"the file leaves this open: {'; '.join(question.question for question in questions)}",
            where=where,
            questions=tuple(questions),
            fix="; ".join(recipes) or f"{options}--sensor FILE.toml",
        )
