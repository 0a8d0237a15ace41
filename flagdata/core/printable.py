"""Text for people: counts, sizes, and names from files, which must move no cursor and turn no line
of text round."""

from __future__ import annotations

SHORT = 12
"""Characters of an id that people are shown; look-ups take any unique beginning."""


def printable(text: str) -> str:
    """Puts a text in one line; control characters, marks of direction and bytes that are not UTF-8
    are escaped."""
    if text.isprintable():
        return text
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in text
    )


def printable_lines(text: str) -> str:
    """Escapes a text of several lines likewise, which stay."""
    return "\n".join(map(printable, text.split("\n")))


def count_of(count: int, noun: str) -> str:
    """Writes "1 object", "2 objects": for nouns that take an s."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def size_text(size: float | None) -> str:
    """Bytes for people: "12.3 MB", decimal units."""
    if size is None:
        return ""
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} TB"
