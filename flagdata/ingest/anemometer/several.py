"""The anemometers of one file, each of which becomes an artifact, and what a file is with what the user says of it."""

from __future__ import annotations

from pathlib import Path

from flagdata.ingest.anemometer.documents.opening import open_text
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.recognition import recognise
from flagdata.ingest.anemometer.restating import bulletins
from flagdata.ingest.anemometer.restating.restate import restate
from flagdata.ingest.anemometer.sniffing import Guess
from flagdata.ingest.anemometer.tables.delimited import drafted, guess, sites
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.winds import site_labels


def anemometers(path: Path | str, options: WindOptions | None = None) -> tuple[str, ...]:
    """Labels of the anemometers of a table that no recipe describes, where it holds several; else none.

    Each can be read by itself: `read_log(path, replace(options, wind=label))`.

    Raises:
        FlagdataError: the file cannot be read as text.
    """
    options = options or WindOptions()
    if options.recipe is not None or options.format not in (None, "delimited"):
        return ()
    source = _table(Path(path), options)
    if options.format is None and options.columns is None:
        guesses = recognise(source)
        if not guesses or guesses[0].format != "delimited" or guesses[0].recipe is not None:
            return ()
    proposal = drafted(source, options)
    if proposal is None or proposal.unsure or proposal.stretches:
        return ()  # which of them is a wind, or when each began, is the user's to say
    labels = sites(source, proposal)
    if options.wind is not None:
        labels = site_labels.of_column(labels, options.wind)
    return labels if len(labels) > 1 else ()


def completed(path: Path | str, options: WindOptions) -> Guess | None:
    """The guess at a table that no recipe describes, with the unit, anemometer and date order that the user names.

    Raises:
        FlagdataError: the file cannot be read as text.
    """
    proposal = drafted(_table(Path(path), options), options)
    return None if proposal is None else guess(proposal)


def _table(path: Path, options: WindOptions) -> TextFile:
    """The file as a table, where it can be restated as one; bulletins need the day that the user gives."""
    source = open_text(path, limits=options.limits, encoding=options.encoding)
    if options.date is not None and bulletins.matches(source.head()):
        return bulletins.dated(source, options.date)
    return restate(source)
