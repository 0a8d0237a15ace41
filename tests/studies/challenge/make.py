"""Makes a challenge: draws the keys, simulates, writes what a user would have, and publishes hashes
of both."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.files.outputs import check_folder, fresh_folder
from flagdata.core.provenance import code_version, recipe_hash
from flagdata.core.rng import stream
from flagdata.errors import FlagdataError
from flagdata.recipes.documents import read_json
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.scene import GRAVITY
from sim.workers import single_threaded
from tests.studies.challenge import folder as files
from tests.studies.challenge.answer_key import AnswerKey, seal
from tests.studies.challenge.design import draw
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.meshes import layout, seen
from tests.studies.challenge.recipe import ChallengeRecipe
from tests.studies.challenge.simulation import SimulatedSet, batches, simulate

_PACE = 1000.0
"""Cells times seconds of a recording that one core simulates in a second: five sets of three
recordings of 13 s on meshes of some 350 took 65 s."""
_FILMED = 20.0
"""Frames that one core films and encodes in a second."""
_NAMES = "abcdefghijklmnopqrstuvwxyz"
_AROUND = 2.0  # m: how far from the origin a pole stands


def workload(recipe: ChallengeRecipe, count: int) -> float:
    """Seconds that one core takes for so many sets."""
    cells = sum(numerics.columns * numerics.rows for numerics in recipe.numerics.values()) / len(
        recipe.numerics
    )
    films = 0.0 if recipe.films is None else recipe.duration * recipe.films.rate / _FILMED
    return count * recipe.count * ((recipe.settle + recipe.duration) * cells / _PACE + films)


def make(
    path: Path,
    recipe: ChallengeRecipe,
    *,
    seed: int,
    count: int,
    workers: int = 1,
    progress: Callable[[int], object] | None = None,
) -> ChallengeFolder:
    """A challenge in a new folder, which appears whole; the same recipe and seed give the same
    bytes on one machine.

    One that was stopped goes on when the same is asked for again: until it is whole it lies beside
    the folder, in `.flagdata-HASH.making`, set by set.

    Args:
        count: of sets.
        workers: batches that are simulated, and filmed, at a time, each in a process of its own.
        progress: called with the number of sets that were written or found.

    Raises:
        ConflictError: something is there.
        FlagdataError: a flag diverged, with weak effects too.
    """
    asked = {
        "recipe": asdict(recipe),
        "seed": seed,
        "sets": count,
        "code": code_version(),
        "folder": path.name,
    }
    with _resumed_folder(
        path, key=recipe_hash(asked), parts=("sets", "sealed", "challenge.json")
    ) as making:
        _make(
            ChallengeFolder(making),
            recipe,
            seed=seed,
            count=count,
            workers=workers,
            progress=progress,
        )
    return ChallengeFolder(path)


@contextmanager
def _resumed_folder(path: Path, *, key: str, parts: Iterable[str]) -> Iterator[Path]:
    """A scratch folder beside a new one, `.flagdata-KEY.making`, that outlives a process that is
    stopped.

    It is taken up where the same key is given again; at the end its parts make the new folder, and
    it is removed, as it is where a FlagdataError says that it can never be whole.

    Args:
        key: hash of all that shapes it.
        parts: names in it that the new folder is to have.

    Raises:
        ConflictError: something is there.
    """
    check_folder(path)
    making = path.absolute().parent / f".flagdata-{key[:16]}.making"
    making.mkdir(parents=True, exist_ok=True)
    try:
        yield making
        with fresh_folder(path) as whole:
            for name in parts:
                (making / name).rename(whole / name)
    except FlagdataError:
        shutil.rmtree(making, ignore_errors=True)
        raise
    shutil.rmtree(making, ignore_errors=True)


def _make(
    target: ChallengeFolder,
    recipe: ChallengeRecipe,
    *,
    seed: int,
    count: int,
    workers: int,
    progress: Callable[[int], object] | None,
) -> None:
    entries: dict[str, dict[str, str]] = {}

    def keep(made: dict[str, dict[str, str]]) -> None:
        entries.update(made)
        if progress is not None:
            progress(len(made))

    waiting: list[tuple[AnswerKey, ...]] = []
    for group in batches(draw(recipe, seed=seed, count=count), recipe.count):
        if all(_kept(target, key).is_file() for key in group):
            keep(_published(target, group))
        else:
            waiting.append(group)
    if workers == 1:
        for group in waiting:
            keep(_made(target, recipe, seed, group))
    else:
        with ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=single_threaded
        ) as pool:
            for done in as_completed(
                [pool.submit(_made, target, recipe, seed, group) for group in waiting]
            ):
                keep(done.result())
    files.write_json(
        target.path / "sealed" / "seed.json", {"seed": seed, "title": recipe.title, "sets": count}
    )
    files.write_json(
        target.public,
        {
            "schema": "flagdata.challenge/1",
            "title": recipe.title,
            "code_version": code_version(),
            "filmed": recipe.films is not None,
            "sets": {name: entries[name] for name in sorted(entries)},
        },
    )


def _kept(target: ChallengeFolder, key: AnswerKey) -> Path:
    """What is to be published of a set, written once the set is."""
    return target.path / "kept" / f"{key.name}.json"


def _published(target: ChallengeFolder, keys: Sequence[AnswerKey]) -> dict[str, dict[str, str]]:
    """Of sets that are written."""
    return {key.name: read_json(_kept(target, key), noun="note of a set") for key in keys}


def _made(
    target: ChallengeFolder, recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey]
) -> dict[str, dict[str, str]]:
    """Simulate a batch and write those of its sets that are not yet; what is published of each."""
    made = simulate(recipe, seed, keys)
    for key in keys:
        if not _kept(target, key).is_file():
            shutil.rmtree(target.data(key.name), ignore_errors=True)
            files.write_json(_kept(target, key), _write(target, recipe, seed, key, made[key.name]))
    return _published(target, keys)


def _write(
    target: ChallengeFolder, recipe: ChallengeRecipe, seed: int, key: AnswerKey, made: SimulatedSet
) -> dict[str, str]:
    if recipe.films is None:
        data = _write_markers(target, recipe, seed, key, made)
    else:
        from tests.studies.challenge.filming import films_of  # which needs a renderer

        data = files.finish(
            target.data(key.name),
            films_of(target.data(key.name), recipe, recipe.films, seed, key, made),
        )
    key = replace(key, impact=made.impact, effects=made.effects)
    salt = stream(seed, key.name, "salt").bytes(32).hex()
    files.write_json(target.sealed(key.name), {"key": key.as_dict(), "salt": salt})
    return {"data": data, "commitment": seal(key, salt)}


def _write_markers(
    target: ChallengeFolder, recipe: ChallengeRecipe, seed: int, key: AnswerKey, made: SimulatedSet
) -> str:
    """Write a set of tracked markers; the hash of its files."""
    markers = layout(recipe, stream(seed, "markers"))
    weights = seen(recipe.numerics[key.numerics], markers, width=recipe.width, height=recipe.height)
    place = np.append(stream(seed, key.name, "place").uniform(-_AROUND, _AROUND, 2), files.HEIGHT)
    names = _NAMES[: recipe.count]
    positions: dict[str, Float32Array] = {}
    for index, (name, track) in enumerate(zip(names, made.positions, strict=True)):
        tracked = np.einsum("mv,fvx->fmx", weights, track.astype(np.float64)) + place
        noise = stream(seed, key.name, "noise", index).normal(0.0, 1.0, tracked.shape)
        positions[name] = (tracked + key.noise * noise).astype(np.float32)
    pins = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, recipe.height]]) + place
    sigma = recipe.weight_sigma(material=key.material, rate=key.rate, noise=key.noise)
    about = {
        "schema": "flagdata.challenge-set/1",
        "flag": {
            **({"area_weight_sigma": sigma} if sigma else {}),
            "material": key.material,
            "width": recipe.width,
            "height": recipe.height,
            "pins": pins.tolist(),
            "pin_stiffness": ARCSIM_STIFFNESS,
            "gravity": list(GRAVITY),
        },
        "rate": key.rate,
        "noise": key.noise,
        "recordings": [
            {"name": name, "wind": _log(recipe, wind)}
            for name, wind in zip(names, made.winds, strict=True)
        ],
    }
    return files.write_set(target.data(key.name), about=about, markers=markers, positions=positions)


def _log(recipe: ChallengeRecipe, wind: FloatArray) -> dict[str, Any]:
    times = np.arange(len(wind)) / recipe.log_rate
    return {"times": times.tolist(), "velocity": wind.tolist()}
