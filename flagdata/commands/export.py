"""`flagdata export`: copies of a selection for other ecosystems."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flagdata.api.lake_verbs import Exporting
from flagdata.core.console import document, echo, progress, say
from flagdata.verbs.verb_options import AsJson, command, options


@options
class ExportCommand(AsJson, Exporting):
    """The same on the command line."""


@command(ExportCommand)
def export(chosen: ExportCommand) -> None:
    """Write a selection as WebDataset, Parquet, LeRobot, Zarr, MP4 + CSV, MCAP, CSV of the wind or
    OBJ folders.

    FORMAT is webdataset, parquet, lerobot, zarr, mp4, mcap, csv for every sample of an anemometer
    or, for mesh sequences, obj. The folder appears whole or not at all, and its manifest.json names
    the version, the filter and the hash of every file:

    \b
      flagdata export webdataset --where "kind = 'clip'" --at v1 --split train --to shards/train
      flagdata export parquet --to catalog
      flagdata export lerobot --where "kind = 'clip'" --split train --to lerobot
      flagdata export csv --where "kind = 'wind'" --to winds
      flagdata export obj --where "kind = 'meshes' and wind > 5" --to meshes
    """
    manifest = export_selection(chosen)
    if chosen.as_json:
        document("export-result", {"folder": str(chosen.to), "manifest": manifest})
        return
    files = manifest["files"]
    size = sum(file["bytes"] for file in files)
    left_out = len(manifest["superseded"])
    if left_out:
        say(
            f"left out: {_count(left_out, 'recording')} that a later alignment of the same files "
            "replaces"
        )
    artifacts = _count(manifest["artifacts"], "artifact")
    say(f"{artifacts} of version {manifest['version']} in {_count(len(files), 'file')}, {size:,} B")
    echo(chosen.to)


def export_selection(chosen: Exporting) -> Mapping[str, Any]:
    """Writes a selection; returns the manifest of its folder.

    Raises:
        FlagdataError: see `flagdata.export`.
    """
    from flagdata.core.files.outputs import check_folder
    from flagdata.dataset.lake_source import open_source
    from flagdata.export import Export, prepare

    target = Path(chosen.to)
    check_folder(target)
    given = {key: getattr(chosen, key) for key in ("frames", "shard_bytes", "shuffle", "crf")}
    request = Export(
        format=chosen.format,
        where=chosen.where,
        at=chosen.at,
        split=chosen.split,
        salt=chosen.salt,
        options={name: value for name, value in given.items() if value is not None},
    )
    prepared = prepare(open_source(chosen.lake).lake, request)
    with progress(len(prepared), label=f"export {chosen.format}", unit="artifact") as advance:
        return prepared.write(target, advance=advance).manifest


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"
