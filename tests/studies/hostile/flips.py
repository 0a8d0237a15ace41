"""Single bits that flip in what flagdata keeps: files of a lake's catalog, banks, kept simulations,
caches.

After each flip what reads the file is asked again. It refuses, or gives what it gave before: since
the bit carries no meaning (a blank, a date in an archive), or since what is a cache was made anew.
Another value without an error is a failure, and so is any exception but an error of flagdata.

    python -m tests.studies.hostile.flips --count 2000 --seed 1 --out flips.json
"""

from __future__ import annotations

import argparse
import json
import os
import random
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.console import foreseen
from flagdata.core.files.object_cache import block_of, keep_blocks
from flagdata.core.schema import Kind
from flagdata.dataset import DecodedCache
from flagdata.errors import UnforeseenError
from flagdata.lake import Artifact, Lake, catalog, expire
from measure.cloth import design
from measure.nulls import bank
from measure.refine import evaluator
from sim.workers import kept_file
from tests.flagdata.lake.conftest import put_older_ref

OUTCOMES = ("refused", "same")


@dataclass(frozen=True, kw_only=True)
class Kept:
    """What is kept in files.

    Attributes:
        files: in which a bit flips.
        read: gives what they hold, as a process does that reads them first; anything that can be
            compared.
    """

    files: Sequence[Path]
    read: Callable[[], Any]


def lake(folder: Path) -> Lake:
    """A lake with all that its catalog can hold: checkpoints and summaries, tags, branches, labels,
    withdrawals."""
    made = Lake.create(folder / "lake")
    every, catalog._TIDY_EVERY = catalog._TIDY_EVERY, 8
    try:
        added = []
        for number in range(20):
            with made.transaction(
                f"measurement {number}", branch="side" if number % 5 == 4 else "main"
            ) as tx:
                artifact = Artifact(
                    kind=Kind.MEASUREMENT, name=f"m{number}", recipe={"of": number}, wind=number / 7
                )
                tx.add(artifact)
            added.append(artifact.id)
            if number == 2:
                made.branch("side")
            if number == 6:
                made.tag("v1")
            if number == 9:
                made.label([added[0]], {"tunnel": "north", "run": 7}, "labels")
    finally:
        catalog._TIDY_EVERY = every
    made.withdraw([added[1]], "wrong")
    made.merge("side", "what was beside")
    expire(made, 3, "old")
    for kind in ("tags", "branches"):
        put_older_ref(made, kind, f"older-{kind}")
    return made


def everything(path: Path) -> Any:
    """What a process that opens a lake reads of it: rows of all refs and of old versions, the log,
    the branches."""
    opened = Lake.open(path)
    refs = {
        name: ref.view for name, ref in {**opened.refs.tags(), **opened.refs.branches()}.items()
    }
    rows = {at: opened.rows(at=at).to_pylist() for at in (None, *refs, "5", "18")}
    labels = opened.table(opened.view(None)).schema.metadata
    history = [
        {key: one for key, one in entry.items() if key != "files"}
        for entry in opened.catalog.history()
    ]
    return rows, refs, labels, history


def of_the_lake(folder: Path) -> dict[str, Kept]:
    """The parts of a lake's catalog."""
    path = lake(folder).path
    assert isinstance(path, Path)
    read = partial(everything, path)
    log = path / "catalog" / "_delta_log"
    parts = {
        "log entries": log.glob("*.json"),
        "files of rows": (path / "catalog").glob("*.parquet"),
        "checkpoints": [*log.glob("*.checkpoint.parquet"), log / "_last_checkpoint"],
        "tags and branches": (path / "refs").glob("*s/older-*.json"),
        "marks": (path / "refs" / "newest").iterdir(),
        "summaries of the log": (path / "refs" / "history").iterdir(),
    }
    return {name: Kept(files=sorted(files), read=read) for name, files in parts.items()}


def of_a_bank(folder: Path) -> Kept:
    """A batch of nulls, with arrays of the right kinds."""
    draw = np.random.default_rng(1)
    arrays: dict[str, Any] = {name: draw.normal(size=(6, 5)) for name in bank._SEGMENTS}
    arrays |= {
        "recording": np.arange(6),
        "cloth": np.array(["a" * 64] * 6),
        "columns": np.array(bank.names()),
    }
    path = folder / "nulls-0000.npz"
    np.savez(
        path,
        version=np.array(bank._VERSION),
        duration=np.array(2.0),
        anchors_told=np.array(True),
        carried=np.array(False),
        **arrays,
    )
    return Kept(
        files=[path], read=lambda: {name: one.tolist() for name, one in bank._content(path).items()}
    )


@dataclass(frozen=True)
class Asked:
    """A batch of simulations that were kept."""

    effort: int = 1

    def content(self) -> Mapping[str, Any]:
        return {"what": "a batch"}


def of_simulations(folder: Path) -> Kept:
    """The kept readings of simulated films."""
    place = folder / "simulations"
    asked: Any = [Asked()]
    path = kept_file(asked[0], place)
    place.mkdir()
    np.savez_compressed(path, readings=np.random.default_rng(2).normal(size=(2, 1, 8, 4)))
    return Kept(files=[path], read=lambda: design.readings_of(asked, folder=place).tolist())


def of_evaluations(folder: Path) -> Kept:
    """The kept evaluation of a simulated film."""
    path = folder / "evaluated.npz"
    draw = np.random.default_rng(3)
    found = evaluator.Evaluated(
        embedding=draw.normal(size=(1, 32)),
        frame=draw.integers(0, 255, (9, 9), np.uint8),
        seconds=dict.fromkeys(evaluator.STAGES, 0.5),
    )
    evaluator._write(path, found)

    def read() -> Any:
        kept = evaluator._read(path)
        return (
            kept.embedding.tolist(),
            None if kept.frame is None else kept.frame.tolist(),
            kept.seconds,
        )

    return Kept(files=[path], read=read)


def of_decoded_clips(folder: Path) -> Kept:
    """A clip of the decoded cache, which is decoded anew where it is damaged."""
    frames = np.random.default_rng(4).integers(0, 255, (5, 12, 12), np.uint8)

    def read() -> Any:
        return (
            DecodedCache(folder / "decoded", limit=10**6)
            .frames("mcap/a", 0, 5, decode=lambda: frames)
            .tolist()
        )

    read()
    return Kept(files=sorted((folder / "decoded").glob("*.clip")), read=read)


def of_blocks(folder: Path) -> Kept:
    """A block of a large object of a bucket, which is fetched anew where it is damaged."""
    os.environ["FLAGDATA_CACHE"] = str(folder / "cache")
    name, data = f"mcap/{'0' * 64}", random.Random(5).randbytes(3000)
    keep_blocks(name, {"0": data})
    return Kept(
        files=[*(folder / "cache").rglob("*.blocks/0")], read=lambda: block_of(name, "0") or data
    )


KINDS: Mapping[str, Callable[[Path], Kept]] = {
    "banks of nulls": of_a_bank,
    "kept simulations": of_simulations,
    "kept evaluations": of_evaluations,
    "decoded cache": of_decoded_clips,
    "blocks of a bucket's objects": of_blocks,
}


def flips(kept: Kept, *, count: int, draw: random.Random) -> dict[str, Any]:
    """Flip one bit after the other: how many were refused or changed nothing, and each that did
    neither."""
    right = kept.read()
    found: Counter[str] = Counter(dict.fromkeys(OUTCOMES, 0))
    failures: list[dict[str, Any]] = []
    for _ in range(count):
        path = draw.choice(kept.files)
        whole = path.read_bytes()
        place, bit = draw.randrange(len(whole)), draw.randrange(8)
        mode = path.stat().st_mode
        path.chmod(0o644)
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
        try:
            outcome = "same" if kept.read() == right else "another value"
        except Exception as error:  # noqa: BLE001  its class is what is counted
            known = foreseen(error)
            outcome = (
                f"unforeseen: {known.what}" if isinstance(known, UnforeseenError) else "refused"
            )
        path.write_bytes(whole)
        path.chmod(mode)
        if outcome in OUTCOMES:
            found[outcome] += 1
        else:
            failures.append({"file": path.name, "byte": place, "bit": bit, "outcome": outcome})
    return {"flips": count, **found, "failures": failures}


def campaign(*, count: int, seed: int) -> dict[str, Any]:
    """Flips of each kind of file, so many of each."""
    before = os.environ.get("FLAGDATA_CACHE")
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            kinds = {**of_the_lake(folder), **{kind: make(folder) for kind, make in KINDS.items()}}
            return {
                kind: flips(kept, count=count, draw=random.Random(f"{seed} {kind}"))
                for kind, kept in kinds.items()
            }
    finally:
        os.environ.pop("FLAGDATA_CACHE", None)
        if before is not None:
            os.environ["FLAGDATA_CACHE"] = before


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.write_text(
        json.dumps(campaign(count=options.count, seed=options.seed), indent=2) + "\n"
    )
