"""The user's own columns: values by name that are put on artifacts, typed, versioned with the branch they are put on.

They are notes of commits, not columns of the stored catalog, so that programs that know nothing of them read the lake
as before. `Store.table` hands them on in its schema's metadata; queries see each as a column `label_<name>`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Collection, Mapping
from typing import TypeAlias

import pyarrow as pa

from flagdata.errors import ConflictError, NotFoundError, UsageError
from flagdata.lake.catalog import persist
from flagdata.lake.lineage import LABELS, labels_of
from flagdata.lake.removal import clips_of
from flagdata.lake.store import Store
from flagdata.schema import catalog_schema

Value: TypeAlias = bool | int | float | str
PREFIX = "label_"
_NAMED = 4
"""Artifacts at most whose ids a remedy names."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
_LONGEST = 1000  # characters of a text


def given(text: str) -> tuple[str, Value | None]:
    """Name and value of "name=value": true and false, a number, else a text; in double quotes always a text. Nothing
    behind the sign takes the label off.

    Raises:
        UsageError: no name and value, a name that cannot be a column, a number that is not finite, or a long text.
    """
    name, sign, written = text.partition("=")
    if not sign:
        raise UsageError(f"{text!r} is no label", fix="write name=value")
    if not written:
        _check(name, None)
        return name, None
    try:
        value = json.loads(written) if re.match(r'[\d"tf-]', written) else written
    except ValueError:
        value = written
    value = value if isinstance(value, bool | int | float | str) else written
    _check(name, value)
    return name, value


def _check(name: str, value: Value | None) -> None:
    """Checks whether a name and value make a label.

    Raises:
        UsageError: a name that cannot be a column, a number that is not finite or too large, or a long text.
    """
    if not _NAME.fullmatch(name):
        fix = "a name is of letters, digits and underscores, a letter first"
        raise UsageError(f"{name!r} is no name of a label", fix=fix)
    if isinstance(value, int | float) and not abs(value) <= sys.float_info.max:  # a NaN neither
        raise UsageError(f"{name} is no finite number", fix="leave the label out where nobody knows")
    if isinstance(value, str) and (len(value) > _LONGEST or not value.isprintable()):
        raise UsageError(f"the text of {name} is longer than {_LONGEST}, or not printable", fix="shorten it")


def put(
    lake: Store, artifacts: Collection[str], values: Mapping[str, Value | None], message: str, *, branch: str
) -> tuple[int, frozenset[str]]:
    """Puts labels on artifacts, see `Lake.label`."""

    def attempt() -> tuple[int, frozenset[str]]:
        head = lake.catalog.head()
        rows = lake.table(lake.refs.view(branch, head))
        identities = set(rows["artifact"].to_pylist())
        if absent := sorted(set(artifacts) - identities):
            raise NotFoundError(
                f"{', '.join(absent)} is not on branch {branch!r}",
                where=str(lake.path),
                fix=f"give ids of rows that flagdata ls --at {branch} shows",
            )
        labelled = frozenset(artifacts) | clips_of(rows, artifacts)
        present = labels_of(rows)
        present_labels = {artifact: present[artifact] for artifact in sorted(present.keys() & identities)}
        _check_types(present_labels, values, except_of=labelled)
        if fresh := {name for name, value in values.items() if value is not None}:
            _check_case(fresh, present_labels)
        noted = {artifact: dict(values) for artifact in sorted(labelled)}
        info = {"message": message, "branch": branch, LABELS: json.dumps(noted, ensure_ascii=False, allow_nan=False)}
        return lake.catalog.append(catalog_schema().empty_table(), base=head, info=info), labelled

    for name, value in values.items():
        _check(name, value)
    with lake.changing("labelling"):
        return persist(attempt, where=lake.catalog.path)


def _check_types(
    present: Mapping[str, Mapping[str, Value]], values: Mapping[str, Value | None], *, except_of: Collection[str]
) -> None:
    """Checks whether a name keeps its type; that of artifacts which are labelled anew does not count.

    Raises:
        ConflictError: it does not.
    """
    for artifact, labels in present.items():
        for name, value in values.items():
            if value is None or artifact in except_of or name not in labels:
                continue
            if kind(labels[name]) != kind(value):
                raise ConflictError(
                    f"{name} is a {kind(labels[name])} on other artifacts, as {labels[name]!r}, not a {kind(value)}",
                    where=artifact,
                    fix="give a value of that type, or take the label off the others: name=",
                )


def _check_case(fresh: Collection[str], present: Mapping[str, Mapping[str, Value]]) -> None:
    """Checks whether all names, new ones and those that artifacts have, are other columns in SQL: it ignores capitals.

    Raises:
        ConflictError: they are not.
    """
    names_by_lower = {name.lower(): name for name in sorted(fresh)}
    for name in {name: None for labels in present.values() for name in labels} | dict.fromkeys(sorted(fresh)):
        first_name = names_by_lower.setdefault(name.lower(), name)
        if first_name != name:
            raise ConflictError(
                f"the labels {name} and {first_name} are one column in SQL, which takes capitals for small letters",
                where=first_name,
                fix="keep one of the two names" + _taking_off(name, present),
            )


def _taking_off(name: str, present: Mapping[str, Mapping[str, Value]]) -> str:
    """Explains how a label is taken off the artifacts that have it, if any do."""
    holders = [artifact for artifact, labels in present.items() if name in labels]
    rest = f"; then repeat this, for the rest of the {len(holders)}" if len(holders) > _NAMED else ""
    return f"; flagdata label {' '.join(holders[:_NAMED])} {name}= takes the other off{rest}" if holders else ""


def kind(value: Value) -> str:
    """Names the type of a label's value in words."""
    return "truth value" if isinstance(value, bool) else "text" if isinstance(value, str) else "number"


def columns(catalog: pa.Table) -> dict[str, pa.Array]:
    """Name of a column → the values of the rows of a table, null where a row has no such label."""
    labels = labels_of(catalog)
    ids = catalog["artifact"].to_pylist()
    labels_of_rows = {artifact: labels[artifact] for artifact in ids if artifact in labels}
    _check_case((), labels_of_rows)
    names = sorted({name for labels_of_row in labels_of_rows.values() for name in labels_of_row})
    return {PREFIX + name: _column([labels.get(artifact, {}).get(name) for artifact in ids]) for name in names}


def _column(values: list[Value | None]) -> pa.Array:
    kinds = {kind(value) for value in values if value is not None}
    if kinds == {"truth value"}:
        return pa.array(values, pa.bool_())
    if kinds == {"number"}:
        return pa.array([None if value is None else float(value) for value in values], pa.float64())
    return pa.array([None if value is None else str(value) for value in values], pa.string())
