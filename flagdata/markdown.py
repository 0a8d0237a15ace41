"""Names that come from outside, as text in Markdown: no HTML, no mark-up, no link and no second column."""

from __future__ import annotations

_ESCAPED = str.maketrans({sign: f"&#{ord(sign)};" for sign in "|`*\\"} | {"&": "&amp;", "<": "&lt;", ">": "&gt;"})


def plain(text: str) -> str:
    """The text on one line, with whatever Markdown would read as more than text written as an HTML entity.

    Entities, unlike backslashes, are text in every dialect, inside a table and outside.
    """
    return " ".join(text.split()).translate(_ESCAPED).replace("](", "&#93;(")
