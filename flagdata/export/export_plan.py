"""One export: rows chosen at a pinned version, one format's files, a manifest, and a folder that
appears whole.

Which of the rows that a filter finds are exported: one side of a split, one alignment of a pair of
files.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.files.manifest import write_manifest
from flagdata.core.files.outputs import fresh_folder
from flagdata.core.provenance import code_version, digest, recipe_hash
from flagdata.core.schema import FORMAT_VERSION, Kind
from flagdata.dataset.clip_lineage import superseded_recordings
from flagdata.dataset.sides import Division, divide, select_columns, stated_sides
from flagdata.dataset.splits import HashedSplit
from flagdata.dataset.tagged import hashed_split
from flagdata.errors import NotFoundError, UsageError
from flagdata.export.croissant import write_croissant
from flagdata.export.export_source import ExportRows
from flagdata.lake import Lake
from flagdata.lake.label_columns import columns
from flagdata.lake.lineage import labels_of, with_labels
from flagdata.lake.selection import Request, Selection
from flagdata.lake.unknown_values import unknown_value
from flagdata.recipes.registry import Registry


def on_side(
    catalog: pa.Table, rows: pa.Table, split: str, *, salt: str, hashed: HashedSplit
) -> tuple[pa.Table, Division]:
    """Selects the rows on one side: clips, and recordings, which go with their clips unless they
    state a side. Two exports of one version never put a session, day, seed or camera file on two
    sides.

    Raises:
        RefusedError: see `flagdata.dataset.sides.divide`.
        UnknownNameError: no such side.
        UsageError: rows of another kind, which are on no side.
    """
    check_kinds(rows, "a split", frozenset({Kind.CLIP, Kind.RECORDING}))
    division = divide(
        catalog, select_columns(rows), HashedSplit(salt=salt) if salt else None, hashed=hashed
    )
    return rows.filter(_is_one_of(set(division.on(split)))), division


def current(catalog: pa.Table, rows: pa.Table) -> tuple[pa.Table, dict[str, str]]:
    """Drops recordings that another among the rows replaces, and the clips of those: two alignments
    of one camera and wind log would hold every picture twice. Also returns: recording left out →
    the later one."""
    recordings = rows.filter(pc.field("kind") == Kind.RECORDING.value)["artifact"].to_pylist()
    replaced = superseded_recordings(
        catalog, {*recordings, *rows["recording"].drop_null().to_pylist()}
    )
    if not replaced:
        return rows, {}
    old = set(replaced)
    stays = ~_is_one_of(old) & (
        pc.field("recording").is_null() | ~_is_one_of(old, column="recording")
    )
    return rows.filter(stays), dict(sorted(replaced.items()))


def _is_one_of(artifacts: set[str], *, column: str = "artifact") -> pc.Expression:
    return pc.field(column).isin(pa.array(sorted(artifacts), pa.string()))


def check_kinds(rows: pa.Table, name: str, kinds: frozenset[Kind]) -> None:
    """Raises:
    UsageError: rows of a kind that is not among `kinds`.
    """
    wrong_kinds = Counter(kind for kind in rows["kind"].to_pylist() if kind not in kinds)
    if wrong_kinds:
        listed = ", ".join(f"{count} of kind {kind}" for kind, count in sorted(wrong_kinds.items()))
        allowed = ", ".join(f"'{kind}'" for kind in sorted(kinds))
        fix = f'choose what it holds: --where "kind in ({allowed})", with your filter'
        raise UsageError(f"{name} cannot hold {listed}", where="--where", fix=fix)


FORMATS = Registry(
    "export format",
    {
        "webdataset": "flagdata.export.webdataset:WebDataset",
        "parquet": "flagdata.export.parquet:Parquet",
        "mp4": "flagdata.export.mp4:Mp4",
        "mcap": "flagdata.export.mcap:Mcap",
        "csv": "flagdata.export.wind_csv:WindCsv",
        "obj": "flagdata.export.obj:ObjFolders",
        "lerobot": "flagdata.export.lerobot:LeRobot",
        "zarr": "flagdata.export.zarr_groups:ZarrGroups",
    },
)


class Exporter(Protocol):
    """A format: a frozen dataclass whose fields are its options."""

    @property
    def kinds(self) -> frozenset[Kind]:
        """The kinds of rows that it can write with these options."""
        ...

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        """Write `source` into the empty `folder`, the same bytes for the same rows; call `advance`
        by rows done.

        Returns:
            what the manifest says about the content: counts, units, conventions.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Export:
    """What to export.

    Attributes:
        format: a name of `FORMATS`.
        where: filter as in `flagdata.lake.selection`; `None` is every row.
        at: ref; `None` is the head of main.
        split: side of the split: only its clips, and the recordings they are of; `None` is
            everything. Data sets state their sides; the others are hashed, see
            `flagdata.dataset.sides.divide`.
        salt: of the hashed split, see `flagdata.dataset.splits.HashedSplit`.
        options: of the format, by name; what is not named keeps its default.
    """

    format: str
    where: str | None = None
    at: str | None = None
    split: str | None = None
    salt: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    def exporter(self) -> Exporter:
        """Builds the format with its options.

        Raises:
            UnknownNameError: no such format.
            UsageError: an option that this format does not take.
        """
        form = FORMATS[self.format]
        names = [f.name for f in dataclasses.fields(form)]
        for name in self.options:
            if name not in names:
                takes = ", ".join(names) or "none"
                raise UsageError(
                    f"{self.format} takes no option {name!r}",
                    where="export",
                    fix=f"its options are: {takes}",
                )
        return form(**self.options)


@dataclass(frozen=True, kw_only=True)
class ExportResult:
    folder: Path
    manifest: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """An export whose rows are settled; nothing is written yet.

    Attributes:
        request: what was asked for.
        exporter: the format with its options.
        version: of the catalog.
        source: the rows.
        superseded: recording left out → the later alignment that replaces it.
    """

    request: Export
    exporter: Exporter
    version: int
    source: ExportRows
    superseded: Mapping[str, str]

    def __len__(self) -> int:
        return len(self.source)

    def write(
        self, target: Path, *, advance: Callable[[int], None] = lambda count: None
    ) -> ExportResult:
        """Write it into the new folder `target`; `advance` is called with the number of rows done.

        Raises:
            ConflictError: `target` exists.
            CorruptError: an object has changed since it was committed.
        """
        request, rows = self.request, self.source.rows
        recipe = {
            "format": request.format,
            "options": dataclasses.asdict(self.exporter),  # pyright: ignore[reportArgumentType]
            "version": self.version,
            "where": request.where,
            "split": request.split,
            "salt": request.salt if request.split else None,
        }
        with fresh_folder(target) as folder:
            content = self.exporter.write(self.source, folder, advance)
            manifest = write_manifest(
                folder,
                {
                    "schema": "flagdata.export/1",
                    **recipe,
                    "split": self.source.side,
                    "split_by": self.source.split_by,
                    "at": request.at,
                    "recipe_hash": recipe_hash(recipe),
                    "code_version": code_version(),
                    "format_version": FORMAT_VERSION,
                    "artifacts": rows.num_rows,
                    "artifacts_hash": digest("\n".join(sorted(rows["artifact"].to_pylist()))),
                    "superseded": dict(self.superseded),
                    "kinds": dict(sorted(Counter(rows["kind"].to_pylist()).items())),
                    **content,
                },
                describe=partial(write_croissant, folder),
            )
        return ExportResult(folder=target, manifest=manifest)


def prepare(lake: Lake, request: Export) -> Prepared:
    """Chooses the rows of an export, at one version.

    Raises:
        NotFoundError: no rows.
        RefusedError: the split, see `flagdata.dataset.sides.divide`.
        UnknownNameError: no such format, ref or side.
        UsageError: rows of a kind that the format cannot write; options it does not take; SQL that
            cannot be run.
    """
    exporter = request.exporter()
    view = lake.view(request.at)
    version = view[0].version
    catalog = lake.table(view)
    rows = Selection(catalog, Request(where=request.where)).table()
    division = None
    if request.split is not None and rows.num_rows:
        matching = rows.num_rows
        hashed = hashed_split(lake, request.at)
        rows, division = on_side(catalog, rows, request.split, salt=request.salt, hashed=hashed)
        if rows.num_rows in (0, matching):
            division.warn_whole()
        if not rows.num_rows:
            raise NotFoundError(
                f"none of the {matching} rows that match is on the side {request.split}; "
                f"{division.grouping}",
                where=f"filter {request.where}, version {version}",
                fix="choose another side by --split, or leave it out",
            )
    rows, replaced = current(catalog, rows)
    check_kinds(rows, request.format, exporter.kinds)
    if not rows.num_rows:
        chosen_by = {"filter": request.where, "version": str(version)}
        where = ", ".join(
            f"{name} {value}" for name, value in chosen_by.items() if value is not None
        )
        raise NotFoundError(
            "no rows match",
            where=where,
            fix=unknown_value(request.where, catalog) or "try the filter with flagdata query",
        )
    labels = labels_of(catalog)
    for name, values in columns(with_labels(rows, labels)).items():
        rows = rows.append_column(name, values)
    division = division or stated_sides(catalog, select_columns(rows))
    source = ExportRows(
        lake=lake,
        rows=rows,
        labels=labels,
        side=request.split or _side_of_all(rows),
        split_by=None if division is None else division.statement,
    )
    return Prepared(
        request=request, exporter=exporter, version=version, source=source, superseded=replaced
    )


def _side_of_all(rows: pa.Table) -> str | None:
    """Returns the side that all rows state; None where they state several, or some none."""
    sides = rows["side"].unique().to_pylist()
    return sides[0] if len(sides) == 1 else None


def export(
    lake: Lake,
    request: Export,
    target: Path,
    *,
    advance: Callable[[int], None] = lambda count: None,
) -> ExportResult:
    """Write a selection of a lake into the new folder `target`; raises as `prepare` and
    `Prepared.write` do."""
    return prepare(lake, request).write(target, advance=advance)
