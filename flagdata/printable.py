"""Names from files as text that can be shown: they must move no cursor, and turn no line of text round."""

from __future__ import annotations


def printable(text: str) -> str:
    """The text in one line; control characters, marks of direction and bytes that are not UTF-8 are escaped."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)
