"""What is done with a lake as a whole, in Python: its catalog asked, its versions tagged,
selections exported.

The options of each call are stated in a class, from which the command of the same name inherits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flagdata.core.console import LocalPath
from flagdata.core.parts import call
from flagdata.errors import UsageError
from flagdata.verbs.option_types import LISTED, POSITIVE
from flagdata.verbs.shared_options import LAKE, AtVersion, OnLake
from flagdata.verbs.verb_options import argument, make_call, option, options

if TYPE_CHECKING:
    from flagdata.dataset.lake_source import AnyLake
    from flagdata.lake.catalog_rows import Rows
    from flagdata.lake.refs import Ref


@options
class Querying(AtVersion, OnLake):
    """Which rows of a lake's catalog are selected."""

    lake: AnyLake = option(LAKE, default=".", kw_only=False, envvar="FLAGDATA_LAKE", metavar="DIR")
    where: str | Mapping[str, Any] | None = option(
        "SQL condition, e.g. \"kind = 'clip' and wind between 3 and 6\"; in Python also values "
        "that columns must have.",
        default=None,
        kw_only=False,
        metavar="EXPR",
    )
    sql: str | None = option(
        "One whole SELECT over the table catalog, instead of --where.",
        default=None,
        metavar="SELECT",
    )
    columns: Sequence[str] | None = option(
        "Columns wanted, in order.", default=None, type=LISTED, metavar="A,B"
    )
    order: str | None = option('SQL order, e.g. "wind desc, start".', default=None, metavar="TERMS")
    limit: int | None = option(
        "Rows at most; 20 in the table for people, else all.",
        default=None,
        type=click.IntRange(min=0),
    )


@make_call(Querying)
def query(chosen: Querying) -> Rows:
    """Rows of a lake's catalog, as `flagdata query` selects them.

    ```python
    rows = flagdata.query("field.lake", "kind = 'clip' and wind between 3 and 6", order="wind desc")
    rows["wind"]  # (n,) array [m/s]
    ```

    `flagdata query --describe` lists the columns with their units.

    Raises:
        UsageError: SQL that cannot be run.
        UnknownNameError: a column that is not there.
        NotFoundError: no such lake, or no such version.
        LimitError: it takes longer, or gives more, than it may.
    """
    from flagdata.dataset.lake_source import open_source

    own = {
        "sql": chosen.sql,
        "columns": chosen.columns,
        "order": chosen.order,
        "limit": chosen.limit,
    }
    return open_source(chosen.lake).query(chosen.where, at=chosen.at, **own)


@options
class Naming(AtVersion, OnLake):
    """Which tag or branch is made, listed or deleted."""

    name: str | None = argument(
        "Of the tag or branch; without one all are listed.", "[NAME]", default=None
    )
    delete: bool = option(
        "Delete NAME; the log notes what it showed.", "-d", "--delete", default=False
    )
    discard: bool = option(
        "--delete: even if no other tag or branch shows its artifacts, which gc then deletes.",
        default=False,
    )
    message: str | None = option("--delete: why.", "-m", "--message", default=None)

    def __post_init__(self) -> None:
        allowed = () if self.name is None else ("discard", "message") if self.delete else ("at",)
        if self.name is None and self.delete:
            raise UsageError("--delete needs a NAME", fix="give the NAME of what is to be deleted")
        for key in ("at", "discard", "message"):
            if getattr(self, key) and key not in allowed:
                what = (
                    "without a NAME"
                    if self.name is None
                    else "with --delete"
                    if self.delete
                    else "without --delete"
                )
                raise UsageError(
                    f"--{key} cannot be given {what}", fix="leave it out, or see --help"
                )


@make_call(Naming)
def tag(chosen: Naming) -> tuple[Ref, ...]:
    """Names a version of a lake for good, as `flagdata tag` does; without a name, lists the tags.

    A tag keeps how the clips of its version are divided: its note "split".

    ```python
    (v2,) = flagdata.tag("v2", lake="field.lake")
    rows = flagdata.query("field.lake", at="v2")
    ```

    Returns:
        The tag that was made, or all; none where one was deleted.

    Raises:
        ConflictError: the name is taken, or was.
        NotFoundError: no such lake, version or tag.
        UsageError: options that contradict each other.
    """
    from flagdata.dataset.tagged import tag

    lake = chosen.opened()
    return _names_of_kind(chosen, lake.refs.tags, put=partial(tag, lake), delete=lake.delete_tag)


@make_call(Naming)
def branch(chosen: Naming) -> tuple[Ref, ...]:
    """Begins a line of work in a lake, as `flagdata branch` does; without a name, lists the
    branches.

    ```python
    (thursday,) = flagdata.branch("thursday", lake="field.lake", at="v1")
    flagdata.ingest("flag.mp4", lake="field.lake", branch="thursday")
    ```

    Returns:
        The branch that was begun, or all; none where one was deleted.

    Raises:
        ConflictError: the name is taken, or was.
        NotFoundError: no such lake, version or branch.
        UsageError: options that contradict each other.
    """
    lake = chosen.opened()
    return _names_of_kind(chosen, lake.refs.branches, put=lake.branch, delete=lake.delete_branch)


def _names_of_kind(
    chosen: Naming,
    listed: Callable[[], Mapping[str, Ref]],
    *,
    put: Callable[..., Ref],
    delete: Callable[..., object],
) -> tuple[Ref, ...]:
    """Lists the names of a kind, or puts or deletes one."""
    if chosen.name is None:
        return tuple(listed().values())
    if not chosen.delete:
        return (put(chosen.name, at=chosen.at),)
    delete(chosen.name, chosen.message, discard=chosen.discard)
    return ()


@options
class Exporting(AtVersion, OnLake):
    """What of a lake is exported, in which form."""

    format: str = argument(
        "webdataset, parquet, lerobot, zarr, mp4, mcap, csv for every sample of an anemometer or, "
        "for mesh sequences, "
        "obj.",
        "FORMAT",
    )
    to: Path | str = option("New folder to write.", type=LocalPath(), metavar="PATH")
    where: str | None = option(
        "SQL condition as in flagdata query; all rows by default.", default=None, metavar="EXPR"
    )
    split: str | None = option(
        "Only this side: train, validation or test, as data sets state it; of other clips by a "
        "hash without leaks.",
        default=None,
        metavar="SIDE",
    )
    salt: str = option(
        "Another text gives another split by the hash.",
        default="",
        metavar="TEXT",
        show_default=False,
    )
    frames: str | None = option(
        "webdataset: jpg (default) or npy; parquet: none (default) or jpg; lerobot: av1 (default) "
        "or png.",
        default=None,
        metavar="FORM",
    )
    shard_bytes: int | None = option(
        "webdataset, parquet: size of a file at most.", default=None, type=POSITIVE
    )
    shuffle: int | None = option(
        "webdataset: order the samples at random.", default=None, metavar="SEED"
    )
    crf: int | None = option(
        "mp4: constant rate factor, 0 (lossless) to 51; 18 by default.", default=None
    )

    def __post_init__(self) -> None:
        if self.salt and self.split is None:
            raise UsageError(
                "--salt needs --split", fix="name the side by --split, or leave out --salt"
            )


@make_call(Exporting)
def export(chosen: Exporting) -> Mapping[str, Any]:
    """Writes a selection of a lake for other programs, as `flagdata export` does.

    ```python
    manifest = flagdata.export("parquet", lake="field.lake", to="catalog", where="kind = 'clip'")
    manifest["files"]  # each with its path, bytes and hash
    ```

    Returns:
        What the folder's manifest.json holds: the version, the filter and the hash of every file.

    Raises:
        ConflictError: the folder is there already.
        MissingExtraError: a form that needs a package which is not installed.
        NotFoundError: no such lake or version, or nothing matches.
        UsageError: a form that is not known, or options that are not of it.
    """
    return call("flagdata.commands.export:export_selection", chosen)
