"""The column of a table that tells sites, stations or sensors apart."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import pairwise

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import stations_by_place
from flagdata.ingest.anemometer.winds.angles import compass_unit
from flagdata.ingest.anemometer.words.headings import understand, words_of

_SITES = frozenset(
    {
        "station", "site", "stid", "id", "sensor", "device", "node", "location", "logger", "mast", "turbine", "address",
        "instrument", "stn", "icao", "standort", "deveui", "serial", "name", "anemometer", "unit", "plot", "city",
        "wea", "wka", "anlage", "aerogenerador", "eolienne", "éolienne",
        "town", "place", "stadt", "ort", "messstelle", "messstation", "wetterstation", "stationsname", "ville", "lieu",
        "poste", "ciudad", "lugar", "estacion", "estación", "cidade", "estacao", "estação", "stazione", "citta",
        "città", "località", "stad", "plaats", "weerstation", "stasjon", "stacja", "miasto", "buoy", "boya", "wtg",
        "turb", "mac", "imei", "eui", "uuid", "gerät", "geraet", "gerat", "knoten", "dispositivo", "nodo", "appareil",
        "capteur", "dispositif", "noeud", "nœud", "apparaat", "enhet", "enhed", "urządzenie", "czujnik", "aparelho",
        "strumento", "beacon", "mote", "probe", "stationname", "stationid", "stationcode", "sitename", "siteid",
        "devicename", "deviceid", "sensorname", "sensorid", "nodeid", "locationname", "wmo", "lake", "river", "airport",
        "port", "harbour", "harbor", "beach", "glacier", "village", "farm", "pier", "bay", "island", "tower", "campus",
        "municipality", "gemeinde", "lac", "lago", "vessel", "boat", "ship", "drone", "flughafen", "hafen", "puerto",
        "aeropuerto", "aéroport", "aeroport",
    }
)  # fmt: skip
_STATIONS = frozenset({"station", "stid", "icao", "site", "stn"})
"""Words of a heading whose cells, where they are words or long numbers, are places, though each has one row."""
_DIGITS = 5
"""Digits of the numbers by which the WMO and others call stations."""
_MOST = 1000
"""Sites beyond which a column of words is something else."""
_FEWEST, _SHARE = 3, 0.6
"""Rows of a site, and the share of the sites that a stamp holds, by which words alone tell sites apart."""
_AT_ONCE = 3
"""Rows of one stamp, all of other words, from which on they are sites though each has that row alone."""
_SPARSE = 3
"""Numbers from the first to the last of a count of rows, for each row that is there."""
_HIGHEST = 200
"""Heights of a mast or a profiler."""
_ADDRESS = re.compile(r"(?:[0-9a-f]{2}[:-]){5,7}[0-9a-f]{2}|(?=.*[a-f])(?:[0-9a-f]{12}|[0-9a-f]{16})", re.IGNORECASE)
"""Addresses of network cards and radio nodes (EUI-48, EUI-64), which are sites whatever their column is called."""
_HEIGHTS = frozenset(
    {
        "height", "heights", "level", "altitude", "elevation", "vertical", "position", "agl", "höhe", "hoehe", "altura",
        "hauteur", "quota", "range", "gate", "gates", "m",
    }
)  # fmt: skip
"""Words of a heading whose numbers tell the heights of a mast or a profiler apart, where each stamp has each once."""
_RELAYS = frozenset({"gateway", "gateways", "gw", "gtw", "rx", "receiver", "router", "bridge", "bssid"})
_NUMBERED = frozenset({"code", "number", "no", "nr", "num", "dev", "end"})
"""Words beside which a heading is still that of a site."""


def sites(layout: Layout, *, time: Sequence[int], stamps: Sequence[str]) -> tuple[int, tuple[str, ...]] | None:
    """The column that tells sites apart, and the sites in the first rows; `None` where all rows are of one.

    Its heading is that of a site; or the rows of different sites share their stamps, or lie apart at the same time.
    """
    shared = len(set(stamps)) < len(stamps)
    apart_by: list[tuple[int, tuple[str, ...]]] = []
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        cells = layout.column(index)
        kinds = _kinds(cells, stamps)
        addresses = _addresses(words, kinds)
        if index in time or understand(name).quantity:
            continue
        if words - {"m"} and words <= _HEIGHTS and _each_once(cells, stamps):
            return index, tuple(kinds)
        if not (words & _SITES or addresses):
            continue
        if not 2 <= len(kinds) <= _MOST:
            continue
        if words & _STATIONS and words <= _STATIONS | _NUMBERED and all(_is_place(kind) for kind in kinds):
            return index, tuple(kinds)
        if (words <= _SITES | _NUMBERED or addresses) and len(cells) >= 3 * len(kinds):
            return index, tuple(kinds)
        if words <= _SITES and len(kinds) == len(cells) and all(map(_is_name, kinds)):
            return index, tuple(kinds)
        apart = {(stamp, cell) for stamp, cell in zip(stamps, cells, strict=True)}
        if _counts_rows(cells, stamps):
            continue
        if shared and len(apart) > 0.9 * len(cells) > 1.2 * len(set(stamps)):
            apart_by.append((index, tuple(kinds)))
    if apart_by:  # a number that each row has for itself tells rows apart, too, but no sites
        return min(apart_by, key=lambda column: len(column[1]))
    if not shared:
        return None
    return _in_every_stamp(layout, time, stamps) or stations_by_place.column(layout, time=time, stamps=stamps)


def _kinds(cells: Sequence[str], stamps: Sequence[str]) -> list[str]:
    """The words of a column in rows that have a stamp: a line of totals below the rows is of no site."""
    stamped = any(stamps)
    return sorted({cell for cell, stamp in zip(cells, stamps, strict=True) if cell and (stamp or not stamped)})


def _each_once(cells: Sequence[str], stamps: Sequence[str]) -> bool:
    """Whether each stamp holds a number of a column once, and the same few numbers return with the stamps."""
    kinds = set(cells)
    rows = len(set(stamps))
    if not 2 <= len(kinds) <= _HIGHEST or rows < 2 or any(cell_kind(kind) != "number" for kind in kinds):
        return False
    return len(set(zip(stamps, cells, strict=True))) == len(cells) >= _SHARE * len(kinds) * rows


def _counts_rows(cells: Sequence[str], stamps: Sequence[str]) -> bool:
    """Whether a column counts the rows, perhaps with some left out: whole numbers that rise from row to row."""
    if len(set(stamps)) < 2 or not all(cell.isdigit() for cell in cells):
        return False
    numbers = [int(cell) for cell in cells]
    rises = all(before < after for before, after in pairwise(numbers))
    return rises and numbers[-1] - numbers[0] <= _SPARSE * len(numbers)


def _is_name(cell: str) -> bool:
    """Whether a cell is a name of words alone: of as many rows with one each every row is of another place."""
    return cell_kind(cell) == "text" and not any(map(str.isdigit, cell))


def _is_place(cell: str) -> bool:
    """Whether a cell is a word, or a number as stations are called by."""
    return cell_kind(cell) == "text" or (cell.isdigit() and len(cell) >= _DIGITS)


def _in_every_stamp(layout: Layout, time: Sequence[int], stamps: Sequence[str]) -> tuple[int, tuple[str, ...]] | None:
    """The column of words, whatever its heading, of which each stamp holds nearly every word once, and the words.

    So do the sites of a table that lists the same hours for each of them; a state, or the weather in words, does not.
    """
    for index, name in enumerate(layout.names):
        cells = layout.column(index)
        kinds = _kinds(cells, stamps)
        if index in time or understand(name).quantity or not 2 <= len(kinds) <= _MOST:
            continue
        if any(cell_kind(kind) != "text" for kind in kinds) or compass_unit(layout, index) is not None:
            continue
        apart = {(stamp, cell) for stamp, cell in zip(stamps, cells, strict=True)}
        if len(apart) < len(cells):
            continue
        rows = len(set(stamps))
        often = len(cells) >= _FEWEST * len(kinds) or (len(cells) >= _AT_ONCE * rows and "" not in cells)
        if often and len(cells) >= _SHARE * len(kinds) * rows:
            return index, tuple(kinds)
    return None


def _addresses(words: Collection[str], kinds: Collection[str]) -> bool:
    """Whether a column holds addresses of devices, and not of what passed their messages on."""
    return bool(kinds) and _RELAYS.isdisjoint(words) and all(_ADDRESS.fullmatch(kind) for kind in kinds)


def site_of_all(layout: Layout, *, apart: Collection[int]) -> tuple[int, str] | None:
    """The column with a site's heading and the one site that the first rows hold; `None` where there is none.

    Args:
        apart: columns of the time or of units, which are none.
    """
    for index, name in enumerate(layout.names):
        words = set(words_of(name))
        kinds = set(layout.column(index))
        named = words & _SITES and words <= _SITES | _NUMBERED
        if index in apart or not (named or _addresses(words, kinds)) or understand(name).quantity:
            continue
        if len(kinds) == 1 and (site := next(iter(kinds))):
            return index, site
    return None
