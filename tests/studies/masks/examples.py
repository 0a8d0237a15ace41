"""Examples of all films, made once and kept: a file each, so that a run that was stopped goes
on."""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flagdata.core.files.outputs import rewrite
from flagdata.core.rng import child_seed, stream
from flagdata.core.schema import Kind
from flagdata.errors import NotFoundError
from flagdata.lake import Lake, MeshSequence, read_meshes
from models.conditioning import Stills
from sim.assets import Assets
from sim.workers import single_threaded
from tests.studies.masks.films import Example, example

_MOST_RUNS = 4
_STILLS = ("usual", "least", "greatest")


def batches(lake: Lake, datasets: Sequence[str], *, side: str) -> list[list[str]]:
    """Mesh sequences of data sets, as objects of the lake, by the batch in which they were
    simulated: flags of one mesh at one rate in winds of their own.

    Raises:
        NotFoundError: there are none.
    """
    table = lake.table(lake.view(None)).select(["kind", "name", "object"])
    found: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for row in table.to_pylist():
        batch = row["name"].rsplit("-", 1)[0]
        if row["kind"] == Kind.MESHES and any(
            batch.rsplit("-", 1)[0] == f"{name}-{side}" for name in datasets
        ):
            found[batch].append((row["name"], row["object"]))
    if not found:
        raise NotFoundError(
            f"no sequences of the {side} side of {', '.join(datasets)}",
            where=str(lake.path),
            fix=f"build them: flagdata build {datasets[0]}",
        )
    return [[stored for _, stored in sorted(found[batch])] for batch in sorted(found)]


def make(
    lake: Lake,
    chosen: Sequence[Sequence[str]],
    folder: Path,
    *,
    count: int,
    seed: int,
    workers: int,
) -> None:
    """Make `count` examples as `NNNNN.npz` in a folder; an empty file stands for a film that shows
    no region."""
    wanted = [k for k in range(count) if not (folder / f"{k:05}.npz").exists()]
    jobs = [(str(lake.path), list(chosen[k % len(chosen)]), folder, k, seed) for k in wanted]
    if workers == 1:
        for job in jobs:
            _one(*job)
        return
    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=single_threaded
    ) as pool:
        for future in [pool.submit(_one, *job) for job in jobs]:
            future.result()


def _one(lake: str, batch: Sequence[str], folder: Path, number: int, seed: int) -> None:
    rng = stream(seed, "masks", "runs", number)
    some = rng.choice(
        len(batch), size=min(len(batch), 1 + int(rng.integers(_MOST_RUNS))), replace=False
    )
    opened = Lake.open(lake)
    runs = [read_meshes(opened.whole_object(batch[int(k)])) for k in some]
    flags = [run for run in runs if isinstance(run, MeshSequence)]
    made = example(flags, seed=child_seed(seed, "masks", number), assets=Assets())
    content = io.BytesIO()
    if made is not None:
        stills = {name: getattr(made.stills, name) for name in _STILLS}
        np.savez_compressed(
            content, pictures=made.pictures, cloth=made.cloth, hoist=made.hoist, **stills
        )
    rewrite(folder / f"{number:05}.npz", content.getvalue())


def read(folder: Path) -> Iterator[Example]:
    """The examples of a folder, in order."""
    for path in sorted(folder.glob("*.npz")):
        if path.stat().st_size:
            with np.load(path) as kept:
                arrays: dict[str, NDArray[np.generic]] = {name: kept[name] for name in kept.files}
            stills = Stills(**{name: arrays.pop(name).astype(np.uint8) for name in _STILLS})
            yield Example(
                pictures=arrays["pictures"].astype(np.uint8),
                stills=stills,
                cloth=arrays["cloth"].astype(np.uint8),
                hoist=arrays["hoist"].astype(np.float32),
            )
