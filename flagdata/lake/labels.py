"""The user's own columns: values by name that are put on artifacts, typed, versioned with the
branch they are put on.

They are notes of commits, not columns of the stored catalog, so that programs that know nothing of
them read the lake as before. `Store.table` hands them on in its schema's metadata; queries see each
as a column, see `flagdata.lake.label_columns`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Collection, Mapping

from flagdata.core.shell import command_line
from flagdata.errors import NotFoundError, UsageError
from flagdata.lake.attempts import persist
from flagdata.lake.commits import Change, commit
from flagdata.lake.label_columns import Value
from flagdata.lake.removal import CLIP_COLUMNS, clips_of
from flagdata.lake.store import Store

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")
_LONGEST = 1000  # characters of a text


def given(text: str) -> tuple[str, Value | None]:
    """Name and value of "name=value": true and false, a number, else a text; in double quotes
    always a text. Nothing behind the sign takes the label off.

    Raises:
        UsageError: no name and value, a name that cannot be a column, a number that is not finite,
            or a long text.
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
        UsageError: a name that cannot be a column, a number that is not finite or too large, or a
            long text.
    """
    if not _NAME.fullmatch(name):
        fix = "a name is of letters, digits and underscores, a letter first"
        raise UsageError(f"{name!r} is no name of a label", fix=fix)
    if isinstance(value, int | float) and not abs(value) <= sys.float_info.max:  # a NaN neither
        raise UsageError(
            f"{name} is no finite number", fix="leave the label out where nobody knows"
        )
    if isinstance(value, str) and (len(value) > _LONGEST or not value.isprintable()):
        raise UsageError(
            f"the text of {name} is longer than {_LONGEST}, or not printable", fix="shorten it"
        )


def put(
    lake: Store,
    artifacts: Collection[str],
    values: Mapping[str, Value | None],
    message: str,
    *,
    branch: str,
) -> tuple[int, frozenset[str]]:
    """Puts labels on artifacts, see `Lake.label`."""

    def attempt() -> tuple[int, frozenset[str]]:
        head = lake.catalog.head()
        rows = lake.columns(lake.refs.view(branch, head), CLIP_COLUMNS)
        identities = set(rows["artifact"].to_pylist())
        if absent := sorted(set(artifacts) - identities):
            raise NotFoundError(
                f"{', '.join(absent)} is not on branch {branch!r}",
                where=str(lake.path),
                fix=f"give ids of rows that {command_line('flagdata', 'ls', '--at', branch)} shows",
            )
        labelled = sorted(frozenset(artifacts) | clips_of(rows, artifacts))
        change = Change(message=message, branch=branch, labels=dict.fromkeys(labelled, values))
        return commit(lake, change, base=head), frozenset(labelled)

    for name, value in values.items():
        _check(name, value)
    with lake.changing("labelling"):
        return persist(attempt, looks=lake.catalog.looks, where=lake.catalog.path)
