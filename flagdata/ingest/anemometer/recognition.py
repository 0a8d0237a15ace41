"""Which format of anemometer logs knows a text: the guesses of all, ranked."""

from __future__ import annotations

from flagdata.ingest.anemometer.formats.registry import FORMATS, Format
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, SURE, Guess, Head
from flagdata.ingest.anemometer.tables.delimited import Delimited, drafted
from flagdata.ingest.anemometer.tables.delimited import guess as drafted_guess
from flagdata.ingest.anemometer.text.source import TextFile


def recognise(source: TextFile) -> tuple[Guess, ...]:
    """Guesses of all anemometer formats at a text file, the likeliest first.

    Where a format knows the file, no recipe is drafted from it: it would have nothing to ask.
    """
    head = Head(lines=tuple(source.head(HEAD_LINES)), counted=source.counted)
    found: list[Guess] = []
    for name in FORMATS:
        if name == Delimited.name:
            continue
        reader: Format = FORMATS[name]()
        guess = reader.recognise(head)
        if guess is not None:
            found.append(guess)
    known = any(guess.score >= SURE for guess in found)
    table = Delimited.by_recipe(head)
    if table is None and not known and (proposal := drafted(source, WindOptions())) is not None:
        table = drafted_guess(proposal)
    if table is not None:
        found.insert(0, table)
    return tuple(sorted(found, key=lambda guess: -guess.score))
