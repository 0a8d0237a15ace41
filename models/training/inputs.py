"""What networks are trained on, prepared once: the front end's output of several crops of each film, on disk.

A network's step takes a few milliseconds, decoding and filtering a clip thirty. So each film is decoded once, cut in
`variants` ways, and what the front end makes of each cut is kept: maps as float16, frames as uint8. An epoch takes one
variant of each film, the next epoch the next. This is exact for all that the augmentation does, since it is done before
the filters; a mirror image, for one, could not be made of the maps, as a maximum of slopes is not minus that of their
negatives.

The folder is disposable and outside the lake; a file is named by the hash of all that shapes it (the pairs' fingerprint,
the front end, the crops, the seed), and a preparation that was stopped goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.lib.format import open_memmap
from numpy.typing import NDArray
from torch import Tensor

from flagdata.dataset.pairs import Pairs
from flagdata.errors import FlagdataError, InputError
from flagdata.provenance import canonical, digest
from flagdata.rng import stream
from models import targets
from models.crops import Cropping
from models.frontend import FrontEnd, standardised

Advance = Callable[[int], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Prepared:
    """Inputs of n entries, `variants` of each, and what is known of them.

    Attributes:
        maps: (n, variants, *shape) float16 or uint8, read from disk as they are needed.
        parameters: name → (n,) values.
        sequence: (n,) seed of the simulation, or a number of its own for each recording that has none.
        fingerprint: of the pairs they were made of.
        front_end: they were made by.
    """

    maps: NDArray[Any]
    parameters: dict[str, NDArray[np.float64]]
    sequence: NDArray[np.int64]
    fingerprint: str
    front_end: FrontEnd

    def __len__(self) -> int:
        return len(self.maps)

    def truth(self, names: Sequence[str]) -> NDArray[np.float64]:
        """(n, target), as `models.targets.truth`.

        Raises:
            InputError: a target that an entry does not state.
        """
        found = targets.truth(self.parameters, names)
        if not np.isfinite(found).all():
            entry, column = (int(k) for k in np.argwhere(~np.isfinite(found))[0])
            raise InputError(
                f"entry {entry} does not state its {names[column]}", where="the training data",
                fix="select recordings that have ground truth, or leave the target out",
            )  # fmt: skip
        return found

    def batch(self, entries: NDArray[np.int64], variant: NDArray[np.int64]) -> Tensor:
        """(len(entries), *shape) float32."""
        return as_input(torch.from_numpy(np.asarray(self.maps[entries, variant])))


def as_input(stored: Tensor) -> Tensor:
    """What was stored as a network takes it: maps as float32, frames standardised clip by clip."""
    if stored.dtype != torch.uint8:
        return stored.float()
    return torch.stack([standardised(clip) for clip in stored])


def prepare_films(
    pairs: Pairs,
    front_end: FrontEnd,
    cropping: Cropping,
    *,
    variants: int,
    seed: int,
    folder: Path,
    workers: int,
    advance: Advance,
    sequences: int | None = None,
) -> Prepared:
    """Random crops of whole films, for training: entries are films.

    Args:
        sequences: how many of the simulations are used, those of a random order's beginning; None for all.
        advance: told how many entries were done.

    Raises:
        InputError: films that are too short, or too few sequences.
        FlagdataError: the disk is full.
    """
    rows = np.unique(pairs.table.recording, return_index=True)[1]
    rows = rows[_first_sequences(pairs, rows, count=sequences, seed=seed)]
    key = {"films": pairs.table.recording[rows].tolist(), "variants": variants, "seed": seed, "crops": asdict(cropping)}

    def made(entry: int) -> list[Tensor]:
        film = pairs.film(int(rows[entry]))
        recording = str(pairs.table.recording[rows[entry]])
        drawn = [cropping.draw(stream(seed, "crop", recording, variant), _shape(film)) for variant in range(variants)]
        return [cropping.cut(film, crop) for crop in drawn]

    return _prepared(pairs, rows, front_end, key, made, variants, folder, workers, advance)


def prepare_clips(
    pairs: Pairs, front_end: FrontEnd, cropping: Cropping, *, folder: Path, workers: int, advance: Advance
) -> Prepared:
    """The catalog's clips as they are, the largest square of each, for validation and tests: entries are clips.

    Raises:
        InputError: clips of another length than the front end takes.
        FlagdataError: the disk is full.
    """
    rows = np.arange(len(pairs))
    key = {"clips": pairs.table.artifact.tolist(), "crops": {"size": cropping.size, "frames": cropping.frames}}

    def made(entry: int) -> list[Tensor]:
        clip = pairs[entry].clip[0].numpy()
        return [cropping.cut(clip, cropping.whole(_shape(clip)))]

    return _prepared(pairs, rows, front_end, key, made, 1, folder, workers, advance)


def _prepared(
    pairs: Pairs,
    rows: NDArray[np.int64],
    front_end: FrontEnd,
    key: dict[str, Any],
    made: Callable[[int], list[Tensor]],
    variants: int,
    folder: Path,
    workers: int,
    advance: Advance,
) -> Prepared:
    frames = front_end.maps == "frames"
    name = digest(canonical({"front_end": front_end.hash, "pairs": pairs.fingerprint, **key}))[:32]
    folder.mkdir(parents=True, exist_ok=True)
    whole, part, done = (folder / f"{name}{suffix}" for suffix in (".npy", ".part.npy", ".done.npy"))
    shape = (len(rows), variants, *front_end.shape)
    try:
        if not whole.exists():
            _fill(part, done, shape, np.dtype(np.uint8 if frames else np.float16), front_end, made, workers, advance)
            part.rename(whole)
            done.unlink()
        else:
            advance(len(rows))
        maps = np.load(whole, mmap_mode="r")
    except OSError as error:
        raise FlagdataError(
            f"preparing the inputs failed: {error.strerror or error}", where=str(folder),
            fix="free some space or name another folder by --cache; what was done is kept",
        ) from error  # fmt: skip
    known = pairs.table.parameters[rows]
    seeded, own = pairs.table.seeded[rows], -1 - np.unique(pairs.table.recording[rows], return_inverse=True)[1]
    return Prepared(
        maps=maps, parameters={str(n): known[:, k] for k, n in enumerate(pairs.table.names)},
        sequence=np.where(seeded, pairs.table.seed[rows], own), fingerprint=pairs.fingerprint, front_end=front_end,
    )  # fmt: skip


def _fill(
    part: Path,
    done: Path,
    shape: tuple[int, ...],
    dtype: np.dtype[Any],
    front_end: FrontEnd,
    made: Callable[[int], list[Tensor]],
    workers: int,
    advance: Advance,
) -> None:
    """Fill what is missing; `done` says of each entry whether it is there."""
    if part.exists() and done.exists():
        maps, there = open_memmap(part, mode="r+"), open_memmap(done, mode="r+")
    else:
        maps = open_memmap(part, mode="w+", dtype=dtype, shape=shape)
        there = open_memmap(done, mode="w+", dtype=np.uint8, shape=shape[:1])
    missing = np.flatnonzero(there == 0).tolist()
    advance(shape[0] - len(missing))

    def fill(entry: int) -> int:
        for variant, clip in enumerate(made(entry)):
            if dtype == np.uint8:
                maps[entry, variant] = clip.round().to(torch.uint8).numpy()
            else:
                maps[entry, variant] = front_end(clip[None])[0].to(torch.float16).numpy()
        return entry

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    pool = ThreadPoolExecutor(workers, thread_name_prefix="inputs")
    try:
        for number, finished in enumerate(as_completed([pool.submit(fill, entry) for entry in missing]), start=1):
            there[finished.result()] = 1
            advance(1)
            if number % 256 == 0:
                maps.flush()
                there.flush()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        torch.set_num_threads(threads)
    maps.flush()
    there.flush()


def _first_sequences(pairs: Pairs, rows: NDArray[np.int64], *, count: int | None, seed: int) -> NDArray[np.bool_]:
    """Which of the films belong to the first `count` simulations of an order that depends on the seed alone."""
    if count is None:
        return np.ones(len(rows), dtype=np.bool_)
    seeds = np.unique(pairs.table.seed[rows])
    if count > len(seeds):
        raise InputError(
            f"{count} sequences are asked for, the training side has {len(seeds)}", where="[data] sequences",
            fix="build a larger data set, or ask for fewer",
        )  # fmt: skip
    chosen = stream(seed, "sequences").permutation(seeds)[:count]
    return np.isin(pairs.table.seed[rows], chosen)


def _shape(film: NDArray[np.uint8]) -> tuple[int, int, int]:
    return film.shape[0], film.shape[1], film.shape[2]
