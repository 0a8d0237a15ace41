"""`flagdata export`: copies of a selection for other ecosystems."""

from __future__ import annotations

from pathlib import Path

import click

from flagdata.console import LocalPath, at_option, document, echo, json_option, lake_option, progress, say
from flagdata.errors import UsageError


@click.command()
@click.argument("format_name", metavar="FORMAT")
@click.option("--to", "target", required=True, type=LocalPath(), help="New folder to write.")
@click.option("--where", metavar="EXPR", help="SQL condition as in flagdata query; all rows by default.")
@at_option
@click.option("--split", metavar="SIDE", help="Only this side of the leakage-safe split: train, validation or test.")
@click.option("--salt", default="", metavar="TEXT", help="Another text gives another split.")
@click.option(
    "--frames",
    metavar="FORM",
    help="webdataset: jpg (default) or npy; parquet: none (default) or jpg; lerobot: av1 (default) or png.",
)
@click.option("--shard-bytes", type=click.IntRange(min=1), help="webdataset, parquet: size of a file at most.")
@click.option("--shuffle", type=int, metavar="SEED", help="webdataset: order the samples at random.")
@click.option("--crf", type=int, help="mp4: constant rate factor, 0 (lossless) to 51; 18 by default.")
@json_option
@lake_option
def export(
    format_name: str,
    target: Path,
    where: str | None,
    at: str | None,
    split: str | None,
    salt: str,
    frames: str | None,
    shard_bytes: int | None,
    shuffle: int | None,
    crf: int | None,
    as_json: bool,
    lake_path: str,
) -> None:
    """Write a selection as WebDataset, Parquet, LeRobot, Zarr, MP4 + CSV, MCAP, CSV of the wind or OBJ folders.

    FORMAT is webdataset, parquet, lerobot, zarr, mp4, mcap, csv for every sample of an anemometer or, for mesh
    sequences, obj. The folder appears whole or not at all, and its manifest.json names the version, the filter and the
    hash of every file:

    \b
      flagdata export webdataset --where "kind = 'clip'" --at v1 --split train --to shards/train
      flagdata export parquet --to catalog
      flagdata export lerobot --where "kind = 'clip'" --split train --to lerobot
      flagdata export csv --where "kind = 'wind'" --to winds
      flagdata export obj --where "kind = 'meshes' and wind > 5" --to meshes
    """
    from flagdata.export import Export, prepare
    from flagdata.lake import Lake
    from flagdata.outputs import check_folder

    if salt and split is None:
        raise UsageError("--salt without --split", fix="name the side by --split, or leave out --salt")
    check_folder(target)
    given = {"frames": frames, "shard_bytes": shard_bytes, "shuffle": shuffle, "crf": crf}
    request = Export(
        format=format_name,
        where=where,
        at=at,
        split=split,
        salt=salt,
        options={name: value for name, value in given.items() if value is not None},
    )
    prepared = prepare(Lake.open(lake_path), request)
    with progress(len(prepared), label=f"export {format_name}", unit="artifact") as advance:
        manifest = prepared.write(target, advance=advance).manifest
    if as_json:
        document("export-result", {"folder": str(target), "manifest": manifest})
        return
    files = manifest["files"]
    size = sum(file["bytes"] for file in files)
    left_out = len(manifest["superseded"])
    if left_out:
        say(f"left out: {_count(left_out, 'recording')} that a later alignment of the same files replaces")
    files = manifest["files"]
    size = sum(file["bytes"] for file in files)
    artifacts = _count(manifest["artifacts"], "artifact")
    say(f"{artifacts} of version {manifest['version']} in {_count(len(files), 'file')}, {size:,} B")
    echo(target)


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"
