"""Names that come from outside, as text in Markdown: no HTML, no mark-up, no link, no second
column. Tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flagdata.answer.answer import Cell
from flagdata.answer.quantity import Quantity

_ESCAPED = str.maketrans(
    {sign: f"&#{ord(sign)};" for sign in "|`*\\"} | {"&": "&amp;", "<": "&lt;", ">": "&gt;"}
)


def plain(text: str) -> str:
    """Puts a text on one line, with whatever Markdown would read as more than text written as an
    HTML entity.

    Entities, unlike backslashes, are text in every dialect, inside a table and outside.
    """
    return " ".join(text.split()).translate(_ESCAPED).replace("](", "&#93;(")


def table(head: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """Writes a table, its cells as text."""

    def cell(content: Cell) -> str:
        match content:
            case None:
                return ""
            case str():
                return plain(content)
            case Quantity():
                return plain(content.text_with_level)
            case _:
                return "<br>".join(map(plain, content))

    lines = [head, ["---"] * len(head), *(map(cell, row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
