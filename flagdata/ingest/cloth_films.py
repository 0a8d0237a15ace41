"""Tables of films of hanging cloth whose material was measured: one row a film.

The recordings of Bouman, Xiao, Battaglia and Freeman (Estimating the material properties of fabric
from video, ICCV 2013) are of this kind: thirty fabrics that hang from a rod, each filmed in three
strengths of a fan's wind, with area weight and bending stiffness measured by themselves. How the
published files are named is not relied on; the table says which film shows what.

Columns: `film` (a path, relative to the table's folder), `fabric` (its name), `area_weight`
[kg/m²]; and, where they are known, `bending_stiffness` [N·m], `wind_level` (a fan's setting, as
text), `wind_speed` and `wind_sigma` [m/s] (a steady wind and its standard uncertainty, both or
neither). Other columns are refused: a misspelt one would be missed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from flagdata.align.cloth_recording import ClothFilm
from flagdata.core.files.addresses import local_path
from flagdata.core.files.plain_text import plain_text
from flagdata.core.files.regular_files import check_input, is_folder
from flagdata.errors import FlagdataError, InputError
from flagdata.ingest.named_columns import check_columns, small_table

COLUMNS = ("film", "fabric", "area_weight")
"""Columns that every table has."""
OPTIONAL = ("bending_stiffness", "wind_level", "wind_speed", "wind_sigma")
_NUMBERS = frozenset({"area_weight", "bending_stiffness", "wind_speed", "wind_sigma"})
SIZE_LIMIT = 1 << 24
"""Largest table that is read [B]."""
_WEIGHTS = (0.005, 5.0)  # kg/m²; silk organza has 0.02, heavy canvas 1


def read_cloths(path: Path) -> tuple[ClothFilm, ...]:
    """Reads the films of a table, CSV (comma, semicolon or tab; a decimal comma beside the latter
    two), in its order.

    Raises:
        NotFoundError: no such table, or a film that it names is not there.
        LimitError: a table too large to be read.
        UnknownNameError: a column that is none of these.
        InputError: columns or values that are missing, doubled or malformed; a film that is named
            twice; a fabric with two area weights or stiffnesses.
    """
    check_input(path, noun="table", limit=SIZE_LIMIT)
    table = small_table(
        plain_text(path.read_bytes(), noun="table", where=str(path)), where=str(path)
    )
    names = table.names
    if not table.rows:
        raise InputError(
            "there are no rows",
            where=str(path),
            fix=f"give a heading with {', '.join(COLUMNS)}, and a row a film",
        )
    check_columns(
        names,
        needed=COLUMNS,
        optional=OPTIONAL,
        where=str(path),
        fix=f"give {', '.join(COLUMNS)}, each once",
    )
    films: list[ClothFilm] = []
    for line, cells in table.rows:
        where = f"{path}, line {line}"
        if len(cells) != len(names):
            raise InputError(
                f"{len(cells)} cells, the heading has {len(names)}",
                where=where,
                fix="mind the delimiters",
            )
        cell = dict(zip(names, cells, strict=True))
        numbers = {name: table.number(cell[name]) for name in names if name in _NUMBERS}
        films.append(_film(cell | numbers, path.parent, where))
        _check_alike(films, where)
    return tuple(films)


def _film(row: Mapping[str, str], folder: Path, where: str) -> ClothFilm:
    for name in COLUMNS:
        if not row[name]:
            raise InputError(
                f"the cell of {name} is empty",
                where=where,
                fix="fill the cell, or leave the row out",
            )
    film = folder / local_path(row["film"])
    if not is_folder(film):
        try:
            check_input(film, noun="film")
        except FlagdataError as error:
            fix = "give the path of a film from the table's folder on"
            raise type(error)(f"{error.what}: {row['film']}", where=where, fix=fix) from None
    area_weight = _number(row, "area_weight", where, unit="kg/m²")
    if area_weight is None or not _WEIGHTS[0] <= area_weight <= _WEIGHTS[1]:
        raise InputError(
            f"the area weight is {row['area_weight']} kg/m²",
            where=where,
            fix=f"give kg/m², {_WEIGHTS[0]:g} to {_WEIGHTS[1]:g}; 1 oz/yd² is 0.0339 kg/m², 100 "
            "g/m² is 0.1",
        )
    speed, sigma = (_number(row, name, where, unit="m/s") for name in ("wind_speed", "wind_sigma"))
    if (speed is None) != (sigma is None) or sigma == 0:
        raise InputError(
            "a wind is given without its uncertainty, or the other way round",
            where=where,
            fix="give wind_speed and wind_sigma (above 0), in m/s, or neither",
        )
    return ClothFilm(
        film=film,
        fabric=row["fabric"],
        area_weight=area_weight,
        wind_level=row.get("wind_level", ""),
        bending_stiffness=_number(row, "bending_stiffness", where, unit="N·m"),
        wind=None if speed is None or sigma is None else (speed, sigma),
    )


def _number(row: Mapping[str, str], name: str, where: str, *, unit: str) -> float | None:
    """Reads a number of 0 or more; None where the cell is empty or the column is not there."""
    text = row.get(name, "")
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise InputError(
            f"{name} is {text!r}",
            where=where,
            fix=f"give a number of 0 or more in {unit}, or nothing",
        )
    return value


def _check_alike(films: list[ClothFilm], where: str) -> None:
    """Make sure that the newest row does not contradict those before it."""
    newest = films[-1]
    for film in films[:-1]:
        if film.film == newest.film:
            raise InputError(
                f"{newest.film.name} is named twice", where=where, fix="keep one of the rows"
            )
        same = (film.area_weight, film.bending_stiffness) == (
            newest.area_weight,
            newest.bending_stiffness,
        )
        if film.fabric == newest.fabric and not same:
            raise InputError(
                f"{newest.fabric} has another area weight or stiffness than before",
                where=where,
                fix="give each fabric one name and its own values in all rows",
            )
