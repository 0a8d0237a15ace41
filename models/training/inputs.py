"""What networks are trained on, prepared once: the front end's output of several crops of each
film, on disk.

A network's step takes a few milliseconds, decoding and filtering a clip thirty. So each film is
decoded once, cut in `variants` ways, and what the front end makes of each cut is kept: maps as
float16, frames as uint8. An epoch takes one variant of each film, the next epoch the next. This is
exact for all that the augmentation does, since it is done before the filters; a mirror image, for
one, could not be made of the maps, as a maximum of slopes is not minus that of their negatives.

The folder is disposable and outside the lake. A film's file is named by the hash of all that shapes
it (the object and its frames, the front end, the crops and their seed), so that trainings of other
seeds, and on parts of the films, share them, and a preparation that was stopped goes on. Each file
ends with its SHA-256, which every run compares before it uses the file; a damaged one is made anew,
with a warning. One process at a time prepares, others wait for it.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, UInt8Array
from flagdata.core.files.checksums import is_sealed, seal_bytes
from flagdata.core.files.file_locks import alone_in
from flagdata.core.files.outputs import rewrite
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.core.rng import stream
from flagdata.core.workload import one_thread
from flagdata.dataset.pairs import Pairs
from flagdata.errors import CorruptError, FlagdataError, InputError
from flagdata.timebase import NANOSECONDS
from models.conditioning.conditioning import VERSION
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd, standardise_clip
from models.networks import targets
from models.training.augment import Augment
from models.training.conditioned_clips import FitFilm
from models.training.timed_film import TimedFilm, has_rate

_LOG = logging.getLogger("flagdata")
_VERSION = {"conditioning": VERSION}
Advance = Callable[[int], None]


@dataclass(frozen=True, kw_only=True)
class Files:
    """One array (variants, *shape) a file; indexed by entries and variants as one array (n,
    variants, *shape) would be.

    Attributes:
        paths: of n files.
        shape: (n, variants, *shape).
    """

    paths: tuple[Path, ...]
    shape: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.paths)

    def __getitem__(self, index: tuple[IntArray, IntArray]) -> AnyArray:
        """Reads (len(entries), *shape) from the entries' files.

        Raises:
            CorruptError: a file that is cut off or gone.
        """
        arrays = []
        for entry, variant in zip(*index, strict=True):
            path = self.paths[entry]
            try:
                arrays.append(np.load(path, mmap_mode="r")[variant])
            except (OSError, ValueError, EOFError) as error:
                raise CorruptError(
                    f"a prepared input cannot be read: {error}",
                    where=str(path),
                    fix="delete the file and give the command again: it is made anew",
                ) from None
        return np.stack(arrays)


@dataclass(frozen=True, kw_only=True, eq=False)
class Prepared:
    """Inputs of n entries, `variants` of each, and their known parameters.

    Attributes:
        maps: (n, variants, *shape) float16 or uint8: an array, or files that are read as they are
            needed.
        parameters: name → (n,) values.
        sequence: (n,) seed of the simulation, or a number of its own for each recording that has
            none.
        fingerprint: of the pairs they were made of.
        front_end: they were made by.
    """

    maps: AnyArray | Files
    parameters: dict[str, FloatArray]
    sequence: IntArray
    fingerprint: str
    front_end: FrontEnd

    def __len__(self) -> int:
        return len(self.maps)

    def in_memory(self) -> Prepared:
        """Reads the inputs into memory, if that leaves half of what is free; small random reads of
        files are slower than steps.

        Raises:
            CorruptError: a file that is cut off or gone.
        """
        import psutil

        if not isinstance(self.maps, Files):
            return self
        count, variants, *shape = self.maps.shape
        first = self.maps[np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)]
        if count * variants * first.nbytes > psutil.virtual_memory().available / 2:
            return self
        maps = np.empty((count, variants, *shape), dtype=first.dtype)
        for entry in range(count):
            maps[entry] = self.maps[np.full(variants, entry), np.arange(variants)]
        return replace(self, maps=maps)

    def truth(self, names: Sequence[str]) -> FloatArray:
        """Returns (n, target), as `models.networks.targets.truth`.

        Raises:
            InputError: a target that an entry does not state.
        """
        return complete_truth(self.parameters, names)

    def batch(self, entries: IntArray, variant: IntArray) -> Tensor:
        """Returns (len(entries), *shape) float32."""
        return as_input(torch.from_numpy(self.maps[entries, variant]))


def complete_truth(parameters: Mapping[str, FloatArray], names: Sequence[str]) -> FloatArray:
    """Returns (n, target), as `models.networks.targets.truth`, where every entry states all of
    them.

    Raises:
        InputError: one that does not.
    """
    values = targets.truth(parameters, names)
    if not np.isfinite(values).all():
        entry, column = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
        raise InputError(
            f"entry {entry} does not state its {names[column]}",
            where="the training data",
            fix="select recordings that have ground truth, or leave the target out",
        )
    return values


def as_input(stored: Tensor) -> Tensor:
    """Converts what was stored to what a network takes: maps as float32, frames standardised clip
    by clip."""
    if stored.dtype != torch.uint8:
        return stored.float()
    return torch.stack([standardise_clip(clip) for clip in stored])


def prepare_films(
    pairs: Pairs,
    front_end: FrontEnd,
    cropping: Cropping,
    *,
    variants: int,
    folder: Path,
    workers: int,
    advance: Advance,
    augment: Augment | None = None,
    sequences: int | None = None,
    seed: int = 0,
) -> Prepared:
    """Prepares random crops of whole films, for training: entries are films.

    The crops depend on the film and the number of the variant alone, not on a training's seed.

    Args:
        augment: what happens to conditioned films beside; None for nothing.
        sequences: how many of the simulations are used, those of a random order's beginning; None
            for all.
        seed: of that order.
        advance: called with the number of entries done.

    Raises:
        InputError: films that are too short, or too few sequences.
        FlagdataError: the disk is full.
    """
    rows, own_rate = (
        film_rows(pairs, sequences=sequences, seed=seed),
        _of_own_rate(pairs, front_end),
    )
    disturbed = augment if augment is not None else Augment()

    def key(row: int) -> dict[str, Any]:
        key_parts = {
            "film": pairs.table.recording[row],
            "variants": variants,
            "crops": json_values(cropping),
        }
        if not cropping.conditioned:
            return key_parts if own_rate[row] else {**key_parts, **_VERSION}
        key_parts |= {"augment": disturbed.identity(), **_VERSION}
        if disturbed.happens("second-flag", str(pairs.table.recording[row])):
            key_parts["beside"] = pairs.table.recording[_row_of_second_film(pairs, row)]
        return key_parts

    def crops(row: int) -> list[Tensor]:
        if cropping.conditioned:
            return _conditioned_crops(
                pairs, row, front_end, cropping, variants=variants, augment=disturbed
            )
        film, recording = pairs.film(row), str(pairs.table.recording[row])
        if not own_rate[row]:
            film = TimedFilm(frames=film, times=pairs.film_times(row)).whole(front_end.rate)
        drawn = [
            cropping.draw(stream(0, "crop", recording, variant), _shape(film))
            for variant in range(variants)
        ]
        return [cropping.cut(film, crop) for crop in drawn]

    return _prepare_pairs(pairs, rows, front_end, key, crops, variants, folder, workers, advance)


def film_rows(pairs: Pairs, *, sequences: int | None, seed: int) -> IntArray:
    """Selects a row of the table for each film, of all simulations or of the first of a random
    order of this seed.

    Raises:
        InputError: fewer simulations than are asked for.
    """
    rows = np.unique(pairs.table.recording, return_index=True)[1]
    return rows[_first_sequences(pairs, rows, count=sequences, seed=seed)]


def prepare_clips(
    pairs: Pairs,
    front_end: FrontEnd,
    cropping: Cropping,
    *,
    folder: Path,
    workers: int,
    advance: Advance,
) -> Prepared:
    """Prepares the catalog's clips, the largest square of each, for validation and tests: entries
    are clips.

    A clip of another rate or length than the front end takes is cut to it, see `clip_as_taken`; so
    is a conditioned one, of its conditioned film.

    Raises:
        InputError: films that are too short or too slow.
        FlagdataError: the disk is full.
    """
    as_stored = _of_own_rate(pairs, front_end) & (pairs.table.frame_count >= front_end.frames)

    def key(row: int) -> dict[str, Any]:
        key_parts = {
            "clip": pairs.table.artifact[row],
            "size": cropping.size,
            "frames": cropping.frames,
        }
        return (
            {**key_parts, **_VERSION} if cropping.conditioned or not as_stored[row] else key_parts
        )

    def crops(row: int) -> list[Tensor]:
        clip = (
            _conditioned_clip(pairs, row, front_end)
            if cropping.conditioned
            else clip_as_taken(pairs, row, front_end)
        )
        return [cropping.cut(clip, cropping.whole(_shape(clip)))]

    return _prepare_pairs(
        pairs, np.arange(len(pairs)), front_end, key, crops, 1, folder, workers, advance
    )


def clip_as_taken(pairs: Pairs, row: int, front_end: FrontEnd) -> UInt8Array:
    """Returns the clip of a row as long as the front end takes, at its rate: (frames, height,
    width) gray.

    A clip of that rate is cut after so many frames. A shorter one goes on in its film, or begins as
    early as its film has to be entered; one of another rate is shown at the front end's instants,
    as conditioned films are.

    Raises:
        InputError: its film is too short or too slow.
    """
    frames, first = front_end.frames, int(pairs.table.frame_first[row])
    own_rate = _of_own_rate(pairs, front_end)[row]
    if own_rate and pairs.table.frame_count[row] >= frames:
        return pairs[row].clip[0, :frames].numpy()
    film = pairs.film(row)
    if own_rate and len(film) >= frames:
        first = min(first, len(film) - frames)
        return film[first : first + frames]
    return TimedFilm(frames=film, times=pairs.film_times(row)).clip_near(
        first, frames, front_end.rate
    )


def _conditioned_crops(
    pairs: Pairs,
    row: int,
    front_end: FrontEnd,
    cropping: Cropping,
    *,
    variants: int,
    augment: Augment,
) -> list[Tensor]:
    """Crops a film at random that was disturbed and conditioned once; each crop starts on a frame
    of its own."""
    recording, times = str(pairs.table.recording[row]), pairs.film_times(row)
    disturbed = augment.before(
        pairs.film(row),
        times,
        source=recording,
        other_film=lambda: pairs.film(_row_of_second_film(pairs, row)),
    )
    film = FitFilm.of(disturbed, times)
    starts, crops = film.starts(front_end.frames, front_end.rate), []
    for variant in range(variants):
        rng = stream(0, "crop", recording, variant)
        clip, instants = film.clip(int(rng.choice(starts)), front_end.frames, front_end.rate)
        clip = augment.after(clip, instants, source=recording, variant=variant, weight=film.weight)
        crops.append(cropping.cut(clip, cropping.draw(rng, _shape(clip))))
    return crops


def _row_of_second_film(pairs: Pairs, row: int) -> int:
    """Selects a row of the film that a second flag is of: of all films in the order of their
    artifacts the next."""
    recordings, first = np.unique(pairs.table.recording, return_index=True)
    row_of_film = int(np.searchsorted(recordings, pairs.table.recording[row]))
    return int(first[(row_of_film + 1) % len(recordings)])


def _conditioned_clip(pairs: Pairs, row: int, front_end: FrontEnd) -> UInt8Array:
    """Returns the clip of a row, of its conditioned film: (frames, size, size)."""
    film = FitFilm.of(pairs.film(row), pairs.film_times(row))
    return film.clip_near(int(pairs.table.frame_first[row]), front_end.frames, front_end.rate)


def _prepare_pairs(
    pairs: Pairs,
    rows: IntArray,
    front_end: FrontEnd,
    key: Callable[[int], dict[str, Any]],
    compute: Callable[[int], list[Tensor]],
    variants: int,
    folder: Path,
    workers: int,
    advance: Advance,
) -> Prepared:
    subfolder = folder / f"{front_end.maps}-{front_end.hash}"
    names = [
        _name(key(row), front_end, str(pairs.table.objects[pairs.table.object[row]]))
        for row in rows.tolist()
    ]
    paths = tuple(subfolder / name[:2] / f"{name}.npy" for name in names)
    try:
        missing = _unsound(list(zip(rows.tolist(), paths, strict=True)), workers)
        advance(len(rows) - len(missing))
        if missing:
            with alone_in(
                subfolder,
                occupied=lambda: _LOG.warning(
                    "flagdata: another process prepares inputs, waiting for it"
                ),
            ):
                still = _unsound(missing, workers)
                advance(len(missing) - len(still))
                _warn_of_damage([path for _, path in still if path.exists()])
                for row, path in still[:1]:  # an error common to all is reported by the first
                    _write(path, compute(row), front_end)
                    advance(1)
                _fill(still[1:], compute, front_end, workers, advance)
    except OSError as error:
        raise FlagdataError(
            f"preparing the inputs failed: {error.strerror or error}",
            where=str(folder),
            fix="free some space or name another folder by --cache; what was done is kept",
        ) from error
    return Prepared(
        maps=Files(paths=paths, shape=(len(rows), variants, *front_end.shape)),
        parameters=pairs.table.parameter_columns(rows),
        sequence=simulations(pairs, rows),
        fingerprint=digest("\n".join([pairs.fingerprint, *names])),
        front_end=front_end,
    )


def simulations(pairs: Pairs, rows: IntArray) -> IntArray:
    """Returns the seed of the simulation of each of some clips, or a number of its own for each
    recording that has none."""
    alone = -1 - np.unique(pairs.table.recording[rows], return_inverse=True)[1]
    return np.where(pairs.table.seeded[rows], pairs.table.seed[rows], alone)


def _of_own_rate(pairs: Pairs, front_end: FrontEnd) -> BoolArray:
    """Returns whether each clip (n,) has the frame rate that the front end's frequencies assume."""
    table = pairs.table
    return has_rate(table.frame_count, (table.end - table.start) / NANOSECONDS, front_end.rate)


def _name(key: dict[str, Any], front_end: FrontEnd, content: str) -> str:
    return digest(canonical({"front_end": front_end.hash, "object": content, **key}))


def _unsound(files: Sequence[tuple[int, Path]], workers: int) -> list[tuple[int, Path]]:
    """Lists the rows and files whose file is missing, or not as it was written."""
    with ThreadPoolExecutor(workers, thread_name_prefix="inputs") as pool:
        sound = pool.map(lambda file: file[1].exists() and is_sealed(file[1]), files)
        return [file for file, good in zip(files, sound, strict=True) if not good]


def _warn_of_damage(paths: Sequence[Path]) -> None:
    if paths:
        _LOG.warning(
            "flagdata: warning: %d prepared inputs are damaged, or of an older version; they are "
            "made anew"
            "\n  where: %s",
            len(paths),
            paths[0],
        )


def _fill(
    missing: Sequence[tuple[int, Path]],
    compute: Callable[[int], list[Tensor]],
    front_end: FrontEnd,
    workers: int,
    advance: Advance,
) -> None:
    pool = ThreadPoolExecutor(workers, thread_name_prefix="inputs")
    with one_thread():
        try:
            todo = [
                pool.submit(lambda row, path: _write(path, compute(row), front_end), row, path)
                for row, path in missing
            ]
            for finished in as_completed(todo):
                finished.result()
                advance(1)
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _write(path: Path, clips: Sequence[Tensor], front_end: FrontEnd) -> None:
    """Writes the front end's output of some clips, with its checksum; a file is whole or not
    there."""
    if front_end.maps == "frames":
        stored = np.stack([clip.round().to(torch.uint8).numpy() for clip in clips])
    else:
        stored = np.stack([front_end(clip[None])[0].to(torch.float16).numpy() for clip in clips])
    content = io.BytesIO()
    np.save(content, stored)
    rewrite(path, seal_bytes(content.getvalue()))


def _first_sequences(pairs: Pairs, rows: IntArray, *, count: int | None, seed: int) -> BoolArray:
    """Masks the films that belong to the first `count` simulations of an order that depends on the
    seed alone."""
    if count is None:
        return np.ones(len(rows), dtype=np.bool_)
    seeds = np.unique(pairs.table.seed[rows])
    if count > len(seeds):
        raise InputError(
            f"{count} sequences are asked for, the training side has {len(seeds)}",
            where="[data] sequences",
            fix="build a larger data set, or ask for fewer",
        )
    chosen = stream(seed, "sequences").permutation(seeds)[:count]
    return np.isin(pairs.table.seed[rows], chosen)


def _shape(film: UInt8Array) -> tuple[int, int, int]:
    return film.shape[0], film.shape[1], film.shape[2]
