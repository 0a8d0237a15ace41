"""Which format of anemometer logs knows a text: the guesses of all, ranked."""

from __future__ import annotations

from flagdata.ingest.anemometer.formats.registry import FORMATS, Format
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, SURE, Guess, Head
from flagdata.ingest.anemometer.tables.delimited import drafted
from flagdata.ingest.anemometer.tables.delimited import guess as drafted_guess
from flagdata.ingest.anemometer.text.source import TextFile


def recognise(source: TextFile) -> tuple[Guess, ...]:
    """Guesses of all anemometer formats at a text file, the likeliest first.

    Where a format knows the file, a draft with doubts has nothing to ask and is left out.
    """
    head = Head(lines=tuple(source.head(HEAD_LINES)), counted=source.counted)
    found: list[Guess] = []
    for name in FORMATS:
        reader: Format = FORMATS[name]()
        guess = reader.recognise(head)
        if guess is not None and guess.draft is not None and len(head.lines) == HEAD_LINES:
            guess = _drafted_of_all(source) or guess
        if guess is not None:
            found.append(guess)
    known = any(guess.score >= SURE and not guess.draft for guess in found)
    told = [guess for guess in found if not (known and guess.doubts)]
    return tuple(sorted(told, key=lambda guess: -guess.score))


def _drafted_of_all(source: TextFile) -> Guess | None:
    """The guess at a table by its first lines, and by later rows that show more of its sites and columns."""
    proposal = drafted(source, WindOptions())
    return None if proposal is None else drafted_guess(proposal)
