"""Names that quantities had in the last version: the one table of them, and how they are read.

A quantity has one name (docs/glossary.md). What a user types under its former name is read with a
warning, what a lake keeps under it is read silently. What hashes are made of keeps the former name
for good: an artifact's identity is that of its recipe, so that a renamed key would make another
artifact of the same source.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

from flagdata.core.console import say
from flagdata.errors import UsageError

V = TypeVar("V")

NAMES: Mapping[str, str] = {
    "density": "area_weight",
    "density_factor": "area_weight_factor",
    "fabric_density": "fabric_area_weight",
    "cloth_density": "cloth_area_weight",
    "density_between": "area_weight_between",
    "density_error": "area_weight_error",
}
"""Former name → name, in JSON, among parameters and among a network's targets."""
KEYS: Mapping[str, str] = {
    old.replace("_", "-"): new.replace("_", "-") for old, new in NAMES.items()
}
"""Former key → key of a recipe's cloth."""
TABLES: Mapping[str, str] = {"pins": "attachment"}
"""Former table → table of an experiment's recipe."""
OF_LOGS: Mapping[str, str] = {"offset": "clock-offset"}
"""Former key → key of the log beside a recording."""
_PARAMETERS = ("density",)
"""Former names among the parameters of a catalog's rows."""
_HASHED = {new: old for old, new in NAMES.items()}


def warn_of_old_name(old: str, new: str, given: Collection[str], *, where: str) -> None:
    """Warns that something has another name now.

    Args:
        given: the names that the user gave.

    Raises:
        UsageError: both names are given.
    """
    if new in given:
        raise UsageError(
            f"{old} is called {new} now, and both are given", where=where, fix="keep one of them"
        )
    say(f"{old} is called {new} now", mark="warning")


def with_present_keys(content: Any, *, where: str, keys: Mapping[str, str] = KEYS) -> Any:
    """Returns a table that a user wrote with its keys as they are called now; raises as
    `warn_of_old_name`."""
    if not isinstance(content, Mapping) or not keys.keys() & content.keys():
        return content
    for old in keys.keys() & content.keys():
        warn_of_old_name(old, keys[old], content, where=where)
    return {keys.get(key, key): value for key, value in content.items()}


def present_name(stored: str) -> str:
    """Returns the name that a quantity has now."""
    return NAMES.get(stored, stored)


def present_names(stored: Mapping[str, V]) -> dict[str, V]:
    """Returns stored values under the names that they have now."""
    return {present_name(name): value for name, value in stored.items()}


def present_recipe(stored: Mapping[str, Any]) -> dict[str, Any]:
    """Returns a stored recipe of `flagdata simulate` whose cloth has its present keys."""
    material = {KEYS.get(key, key): value for key, value in stored.get("material", {}).items()}
    if "table" in material:
        material["table"] = {KEYS.get(key, key): value for key, value in material["table"].items()}
    return {**stored, "material": material} if material else dict(stored)


def present_sql(column: str) -> str:
    """Writes SQL that gives a column of JSON objects with their present names; of cloth models the
    text as it is, in which an air force has a density."""
    renamed = f'"{column}"'
    for old in _PARAMETERS:
        renamed = f"replace({renamed}, '\"{old}\":', '\"{NAMES[old]}\":')"
    return f"""CASE WHEN "kind" = 'model' THEN "{column}" ELSE {renamed} END AS "{column}\""""


def present_query(text: str | None) -> str | None:
    """Returns a user's SQL that names parameters as they are called now, and warns of each old
    name."""
    if text is None:
        return None
    for old in _PARAMETERS:
        pattern = re.compile(
            rf"""(\bparameters"?\s*(?:->>?|,)\s*'(?:\$\.)?){old}(?=')""", re.IGNORECASE
        )
        if pattern.search(text):
            warn_of_old_name(old, NAMES[old], (), where=text)
            text = pattern.sub(rf"\g<1>{NAMES[old]}", text)
    return text


def hashed_names(values: Mapping[str, V]) -> dict[str, V]:
    """Returns values under the names that identities know them by."""
    return {_HASHED.get(name, name): value for name, value in values.items()}


def hashed_name(name: str) -> str:
    """Returns the name that identities know a quantity by."""
    return _HASHED.get(name, name)


def hashed_key(key: str) -> str:
    """Returns the recipe key by which random draws know a quantity: a draw depends on the name that
    it is for."""
    return hashed_name(key.replace("-", "_")).replace("_", "-")
