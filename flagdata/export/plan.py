"""One export: rows chosen at a pinned version, one format's files, a manifest, and a folder that appears whole."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.compute as pc

from flagdata.dataset.lineage import superseded
from flagdata.dataset.resolve import clips_on_side
from flagdata.dataset.splits import HashedSplit
from flagdata.errors import NotFoundError, UsageError
from flagdata.export.source import Source
from flagdata.export.target import fresh_folder, write_manifest
from flagdata.lake import Lake
from flagdata.provenance import code_version, digest, recipe_hash
from flagdata.query import Request, Selection
from flagdata.registry import Registry
from flagdata.schema import FORMAT_VERSION, Kind

FORMATS = Registry(
    "export format",
    {
        "webdataset": "flagdata.export.webdataset:WebDataset",
        "parquet": "flagdata.export.parquet:Parquet",
        "mp4": "flagdata.export.mp4:Mp4",
        "mcap": "flagdata.export.mcap:Mcap",
    },
)


class Exporter(Protocol):
    """A format: a frozen dataclass whose fields are its options."""

    @property
    def kinds(self) -> frozenset[Kind]:
        """Of rows it can write, with these options."""
        ...

    def write(self, source: Source, folder: Path, advance: Callable[[int], None]) -> Mapping[str, Any]:
        """Write `source` into the empty `folder`, the same bytes for the same rows; call `advance` by rows done.

        Returns:
            what the manifest says about the content: counts, units, conventions.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class Export:
    """What to export.

    Attributes:
        format: a name of `FORMATS`.
        where: filter as in `flagdata.query`; `None` is every row.
        at: ref; `None` is the head of main.
        split: side of the leakage-safe split: only its clips, and the recordings they are of; `None` is everything.
        salt: of the split, see `flagdata.dataset.splits.HashedSplit`.
        options: of the format, by name; what is not named keeps its default.
    """

    format: str
    where: str | None = None
    at: str | None = None
    split: str | None = None
    salt: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    def exporter(self) -> Exporter:
        """The format with its options.

        Raises:
            UnknownNameError: no such format.
            UsageError: an option that this format does not take.
        """
        made = FORMATS[self.format]
        known = [f.name for f in dataclasses.fields(made)]
        for name in self.options:
            if name not in known:
                takes = ", ".join(known) or "none"
                raise UsageError(
                    f"{self.format} takes no option {name!r}", where="export", fix=f"its options are: {takes}"
                )
        return made(**self.options)


@dataclass(frozen=True, kw_only=True)
class ExportResult:
    folder: Path
    manifest: Mapping[str, Any]


def export(
    lake: Lake, request: Export, target: Path, *, advance: Callable[[int], None] = lambda count: None
) -> ExportResult:
    """Write a selection of a lake into the new folder `target`.

    Raises:
        ConflictError: `target` exists.
        NotFoundError: no rows.
        UsageError: rows of a kind that the format cannot write; options it does not take.
    """
    exporter = request.exporter()
    view = lake.view(request.at)
    version = view[0].version
    catalog = lake.table(view)
    rows = Selection(catalog, Request(where=request.where)).table()
    if request.split is not None:
        rows = _on_side(catalog, rows, request.split, salt=request.salt)
    rows, replaced = _current(catalog, rows)
    _check_kinds(rows, request.format, exporter.kinds)
    if not rows.num_rows:
        given = {"where": request.where, "split": request.split, "version": str(version)}
        where = ", ".join(f"{name} {value}" for name, value in given.items() if value is not None)
        raise NotFoundError("no rows match", where=where, fix="try the filter with flagdata query")
    recipe = {
        "format": request.format, "options": dataclasses.asdict(exporter), "version": version,  # pyright: ignore[reportArgumentType]
        "where": request.where, "split": request.split, "salt": request.salt if request.split else None,
    }  # fmt: skip
    with fresh_folder(target) as folder:
        content = exporter.write(Source(lake=lake, rows=rows), folder, advance)
        manifest = write_manifest(
            folder,
            {
                **recipe,
                "at": request.at,
                "recipe_hash": recipe_hash(recipe),
                "code_version": code_version(),
                "format_version": FORMAT_VERSION,
                "artifacts": rows.num_rows,
                "superseded": replaced,
                "artifacts_hash": digest("\n".join(sorted(rows["artifact"].to_pylist()))),
                "kinds": dict(sorted(Counter(rows["kind"].to_pylist()).items())),
                **content,
            },
        )
    return ExportResult(folder=target, manifest=manifest)


def _on_side(catalog: pa.Table, rows: pa.Table, split: str, *, salt: str) -> pa.Table:
    """The rows on one side: clips, and recordings by their clips. Sides are decided over all clips of the version, so
    that two exports of one version never put a session, day, seed or camera file on two sides."""
    _check_kinds(rows, "a split", frozenset({Kind.CLIP, Kind.RECORDING}))
    clips = clips_on_side(catalog, split, HashedSplit(salt=salt))
    of_clips = catalog.filter(_is_one_of(clips))["recording"].drop_null().to_pylist()
    return rows.filter(_is_one_of({*clips, *of_clips}))


def _current(catalog: pa.Table, rows: pa.Table) -> tuple[pa.Table, dict[str, str]]:
    """The rows without recordings that another among them replaces, and without the clips of those: two alignments of
    one camera and wind log would hold every picture twice. Also: recording left out → the later one."""
    recordings = rows.filter(pc.field("kind") == Kind.RECORDING.value)["artifact"].to_pylist()
    replaced = superseded(catalog, {*recordings, *rows["recording"].drop_null().to_pylist()})
    if not replaced:
        return rows, {}
    old = set(replaced)
    kept = ~_is_one_of(old) & (pc.field("recording").is_null() | ~_is_one_of(old, column="recording"))
    return rows.filter(kept), dict(sorted(replaced.items()))


def _is_one_of(artifacts: set[str], *, column: str = "artifact") -> pc.Expression:
    return pc.field(column).isin(pa.array(sorted(artifacts), pa.string()))


def _check_kinds(rows: pa.Table, name: str, kinds: frozenset[Kind]) -> None:
    others = Counter(kind for kind in rows["kind"].to_pylist() if kind not in kinds)
    if others:
        found = ", ".join(f"{count} of kind {kind}" for kind, count in sorted(others.items()))
        first = next(kind for kind in Kind if kind in kinds)
        raise UsageError(
            f"{name} cannot hold {found}", where="--where", fix=f"restrict the filter, e.g. kind = '{first}'"
        )
