"""Which sources of `flagdata close-loop` are films with logs, or tables of observables."""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.addresses import local_path
from flagdata.lake import Lake
from flagdata.lake.naming import COLUMNS, meant
from flagdata.sources import FILMED
from measure.calibrate.columns import names
from measure.calibrate.filmed import is_table
from measure.observables import OBSERVABLES

_DESCRIPTIONS = (".toml", ".json")


def films_among(
    sources: Sequence[str], *, lake: Lake | None, at: str, sized: bool = False, tracked: bool = False
) -> tuple[str, ...]:
    """Those that are films or tables of observables, not markers and meshes.

    Args:
        sized: whether a flag's size is given, which films need: then what cannot be found was meant as one, if nothing
            else was.
        tracked: whether there are recordings of markers beside the sources.

    Raises:
        FlagdataError: a table that cannot be read.
    """
    found = {source: is_film(source, lake=lake, at=at) for source in sources}
    if sized and not tracked and not any(found.values()):
        found = {source: is_film(source, lake=lake, at=at, otherwise=True) for source in sources}
    return tuple(source for source, own in found.items() if own)


def is_film(source: str, *, lake: Lake | None, at: str, otherwise: bool = False) -> bool:
    """Whether a source is a film, a recording or clip of a lake, or a table of observables.

    Args:
        otherwise: the answer for what is neither a file nor an artifact.
    """
    path = local_path(source)
    if path.is_dir():
        return False
    if path.is_file():
        if not is_table(source):
            return path.suffix.lower() not in _DESCRIPTIONS
        columns = names(path)
        return "marker" not in columns and bool(columns & set(OBSERVABLES))
    if lake is None:
        return otherwise
    rows = lake.rows({}, at=at, columns=COLUMNS).to_pylist()
    kinds = {row["kind"] for row in meant(rows, source, kinds=FILMED)}
    return bool(kinds & set(FILMED)) if kinds else otherwise
