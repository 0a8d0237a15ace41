"""The folder of a challenge.

challenge.json            title, versions, and of every set the hashes of its data and of its sealed
key sets/set-001/set.json     what a user would know: cloth, pins, rate, noise, wind beside each
recording sets/set-001/*.npy        markers.npy (marker, 2) [m]; a.npy, b.npy, … (frame, marker, 3)
[m] float32 sets/set-001/*.mp4        in their place, where sets are films: a.mp4, b.mp4, …
sealed/set-001.json       key and salt; seed.json verdicts/set-001.json     as filed, with
set-001.sha256 opened.json               once the keys were opened: hashes of the verdicts that were
filed before
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.files.outputs import rewrite
from flagdata.core.provenance import canonical, digest, file_hash
from flagdata.errors import CorruptError, InputError, NotFoundError, UnknownNameError
from flagdata.recipes.documents import read_json
from flagdata.recipes.shelves import is_name
from measure.trajectories import (
    AREA_WEIGHT_UNCERTAINTY,
    Experiment,
    Specimen,
    Trajectory,
    WindTrack,
    as_seen,
)
from sim.cloth.handles import corners
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from tests.studies.challenge.films import Filmed, read_films

# of every file of a set: the time of writing would show which sets were simulated together
_EPOCH = 1_600_000_000
MODEL_COLUMNS, MODEL_ROWS = 15, 10
"""Cells of the participant's mesh: 176 vertices."""
HEIGHT = 2.0
"""Height of a flag's lower corner [m]."""


@dataclass(frozen=True)
class ChallengeFolder:
    """Paths of a challenge, and reading what is public of it.

    Attributes:
        path: of the folder.
    """

    path: Path

    def data(self, name: str) -> Path:
        """Folder of a set."""
        return self.path / "sets" / name

    def sealed(self, name: str) -> Path:
        """File with a set's key."""
        return self.path / "sealed" / f"{name}.json"

    def verdict(self, name: str) -> Path:
        """File of a set's verdict."""
        return self.path / "verdicts" / f"{name}.json"

    def verdict_hash(self, name: str) -> Path:
        """File with its hash."""
        return self.path / "verdicts" / f"{name}.sha256"

    @property
    def public(self) -> Path:
        return self.path / "challenge.json"

    @property
    def opened(self) -> Path:
        return self.path / "opened.json"

    def manifest(self) -> dict[str, Any]:
        """What was published.

        Raises:
            NotFoundError: no challenge there.
            CorruptError: it is no JSON, or does not state its sets.
        """
        if not self.public.is_file():
            raise NotFoundError(
                "no challenge.json",
                where=str(self.path),
                fix="check the path, or make one: `python -m tests.studies challenge make`",
            )
        content = read_json(self.public, noun="challenge")
        sets, hashes = content.get("sets"), ("data", "commitment")
        stated = (
            isinstance(content.get("title"), str)
            and isinstance(sets, dict)
            and all(
                isinstance(entry, dict)
                and all(isinstance(entry.get(key), str) for key in hashes)
                and is_name(name)
                and Path(name).name == name
                for name, entry in sets.items()
            )
        )
        if not stated:
            raise CorruptError(
                "the challenge does not state its title and its sets",
                where=str(self.public),
                fix="restore the file as it was made",
            )
        return content

    def names(self) -> list[str]:
        """Names of the sets, sorted."""
        return sorted(self.manifest()["sets"])

    def chosen(self, only: tuple[str, ...]) -> list[str]:
        """All sets, or those of these names.

        Raises:
            UnknownNameError: one is not there.
        """
        names = self.names()
        for name in only:
            if name not in names:
                raise UnknownNameError.of("set", name, names, where=str(self.path))
        return [name for name in names if not only or name in only]

    def seal(self, name: str) -> dict[str, Any]:
        """What is sealed of a set: key and salt.

        Raises:
            NotFoundError: it is not there.
            CorruptError: it is no JSON.
        """
        path = self.sealed(name)
        if not path.is_file():
            raise NotFoundError(
                "no sealed key", where=str(path), fix="bring it from where the challenge was made"
            )
        return read_json(path, noun="sealed key")

    def checked(self, name: str) -> None:
        """Make sure that a set's data are those that were published.

        Raises:
            CorruptError: they are not.
        """
        try:
            found = data_hash(self.data(name))
        except OSError as error:
            raise CorruptError(
                f"the data cannot be read: {error.strerror}",
                where=str(self.data(name)),
                fix="restore the folder as it was made",
            ) from None
        if found != self.manifest()["sets"][name]["data"]:
            raise CorruptError(
                "the data are not those that were published",
                where=str(self.data(name)),
                fix="restore the folder as it was made",
            )

    @property
    def filmed(self) -> bool:
        """Whether its sets are films, and not tracked markers."""
        return self.manifest().get("filmed") is True

    def films(self, name: str) -> Filmed:
        """A set of films, as `experiment`."""
        self.checked(name)
        return read_films(self.data(name))

    def experiment(self, name: str) -> Experiment:
        """A set of tracked markers as what it is to be judged by.

        Raises:
            CorruptError: its data were changed.
        """
        self.checked(name)
        return read_set(self.data(name))


def data_hash(folder: Path) -> str:
    """Over the names and the bytes of the files of a set."""
    return digest(canonical({path.name: file_hash(path) for path in sorted(folder.iterdir())}))


def write_json(path: Path, content: Mapping[str, Any]) -> str:
    """Write canonical JSON so that a reader sees all of it or nothing; its SHA-256."""
    text = canonical(content) + "\n"
    rewrite(path, text)
    return digest(text)


def write_set(
    folder: Path,
    *,
    about: Mapping[str, Any],
    markers: FloatArray,
    positions: Mapping[str, Float32Array],
) -> str:
    """Write a set's files, all with one time of change; the hash over them."""
    folder.mkdir(parents=True)
    np.save(folder / "markers.npy", markers)
    for name, track in positions.items():
        np.save(folder / f"{name}.npy", track)
    return finish(folder, about)


def finish(folder: Path, about: Mapping[str, Any]) -> str:
    """Write what is stated beside a set's other files, and give all one time of change; the hash
    over them."""
    write_json(folder / "set.json", about)
    for path in (*folder.iterdir(), folder):
        os.utime(path, (_EPOCH, _EPOCH))
    return data_hash(folder)


def read_set(folder: Path) -> Experiment:
    """A set's recordings with what is known beside them.

    Raises:
        NotFoundError: no set there.
        InputError: files that do not fit.
    """
    if not (folder / "set.json").is_file():
        raise NotFoundError("no set.json", where=str(folder), fix="name the folder of a set")
    try:
        about = read_json(folder / "set.json", noun="set")
        flag = about["flag"]
        mesh = grid(
            width=flag["width"], height=flag["height"], columns=MODEL_COLUMNS, rows=MODEL_ROWS
        )
        beside = {path.name: path for path in folder.iterdir()}
        markers = _array(beside["markers.npy"])
        specimen = Specimen(
            mesh=mesh,
            material=named_material(flag["material"]),
            held=corners(mesh.rest),
            anchors=np.array(flag["pins"]),
            stiffness=flag["pin_stiffness"],
            gravity=tuple(flag["gravity"]),
            anchors_given=False,
            area_weight_uncertainty=float(flag.get("area_weight_sigma", AREA_WEIGHT_UNCERTAINTY)),
        )
        recordings = tuple(
            Trajectory(
                name=entry["name"],
                markers=markers,
                positions=_array(beside[f"{entry['name']}.npy"]),
                rate=about["rate"],
                noise=about["noise"],
                wind=WindTrack(
                    times=np.array(entry["wind"]["times"]),
                    velocity=np.array(entry["wind"]["velocity"]),
                ),
            )
            for entry in about["recordings"]
        )
    except (
        KeyError,
        IndexError,
        TypeError,
        ValueError,
        OverflowError,
        AttributeError,
        EOFError,
        OSError,
    ) as error:
        raise InputError(
            f"not a set: {error!r}", where=str(folder), fix="restore the folder as it was made"
        ) from error
    return Experiment(specimen=as_seen(specimen, recordings), recordings=recordings)


def _array(path: Path) -> FloatArray:
    """The numbers of a file of NumPy.

    Raises:
        ValueError: its header states no numbers, or another count of them than the file holds.
    """
    with path.open("rb") as stream:
        try:
            first = np.lib.format.read_magic(stream) == (1, 0)
            header = (
                np.lib.format.read_array_header_1_0
                if first
                else np.lib.format.read_array_header_2_0
            )
            shape, _, kind = header(stream)
        except (
            Exception
        ) as error:  # NumPy reads headers as Python, whose tokenizer raises errors of its own
            raise ValueError(f"{path.name} has no header of NumPy: {error}") from error
        size = path.stat().st_size - stream.tell()
    if (
        kind.kind not in "fiu"
        or min(shape, default=0) < 0
        or math.prod(shape) * kind.itemsize != size
    ):
        raise ValueError(f"{path.name} states {shape} of {kind}, and holds {size} bytes")
    return np.load(path, allow_pickle=False).astype(np.float64)
