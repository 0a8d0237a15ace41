"""Sets that are films with a log of the wind, as a participant reads them.

All sets of a challenge share the winds and what is stated of the camera's place, as experiments in
one tunnel do, so that a participant simulates once for all of them. Where the camera really stood
differs from what is stated within the stated uncertainty.

sets/set-001/set.json     the flag's size, where the camera stood, and the log beside each recording
sets/set-001/a.mp4, …     the films
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.findings import Finding
from flagdata.core.stated import Stated
from flagdata.errors import InputError, NotFoundError
from flagdata.recipes.documents import read_json
from measure.cloth import AZIMUTH, ELEVATION, Flag, Log, Normal, Observed, Uncertain

SCHEMA = "flagdata.challenge-films/1"


@dataclass(frozen=True, kw_only=True, eq=False)
class Filmed:
    """A set as a participant has it.

    Attributes:
        flag: its size; it is held at the corners of its hoist.
        azimuth, elevation: of the camera's axis to the wind, as they are stated.
        distance: of the camera [m].
        area_weight: of a cloth that was weighed [kg/m²]; None where it was not.
        recordings: name → film and log beside it.
    """

    flag: Flag
    azimuth: Uncertain
    elevation: Uncertain
    distance: float
    area_weight: Stated | None
    recordings: Mapping[str, tuple[Path, Log]]

    def observed(self) -> tuple[tuple[Observed, ...], tuple[Finding, ...]]:
        """What its films show, in the order of the recordings, and a warning for each that is left
        out, as `flagdata close-loop` leaves it out.

        Raises:
            FlagdataError: in none of the films a flag is found.
        """
        from flagdata.ingest.films.film import CameraFilm
        from measure.cloth import Part, usable
        from measure.film import ConditionedFilm, FlagSize

        size = FlagSize(length=self.flag.length, height=self.flag.height)

        def read(name: str) -> Observed:
            path, log = self.recordings[name]
            return Part.of(
                ConditionedFilm(CameraFilm(path), aspect=size.aspect), log, source=name
            ).read(size)

        shown, left_out = usable(list(self.recordings), read, name=str)
        return tuple(shown), left_out


def read_films(folder: Path) -> Filmed:
    """A set as a participant reads it.

    Raises:
        NotFoundError: no set there.
        InputError: files that do not fit.
    """
    if not (folder / "set.json").is_file():
        raise NotFoundError("no set.json", where=str(folder), fix="name the folder of a set")
    try:
        about = read_json(folder / "set.json", noun="set")
        flag, camera, cup = about["flag"], about["camera"], about["anemometer"]
        weighed, beside = about["area_weight"], {path.name: path for path in folder.iterdir()}

        def angle(known: Uncertain, stated: Any) -> Uncertain:
            mean, sigma = (math.radians(float(value)) for value in stated)
            return Uncertain(
                name=known.name, unit="rad", prior=Normal(mean=mean, sigma=sigma), source="stated"
            )

        return Filmed(
            flag=Flag(length=float(flag["length"]), height=float(flag["height"])),
            azimuth=angle(AZIMUTH, camera["azimuth"]),
            elevation=angle(ELEVATION, camera["elevation"]),
            distance=float(camera["distance"]),
            area_weight=None
            if weighed is None
            else Stated(
                low=float(weighed[0]),
                high=float(weighed[0]),
                sigma=float(weighed[0]) * float(weighed[1]),
            ),
            recordings={
                entry["name"]: (
                    beside[f"{entry['name']}.mp4"],
                    Log(
                        times=np.array(entry["times"], dtype=np.float64),
                        speed=np.array(entry["speed"], dtype=np.float64),
                        distance=float(cup["distance_constant"]),
                        averaging=float(cup["averaging"]),
                    ),
                )
                for entry in about["recordings"]
            },
        )
    except (
        KeyError,
        IndexError,
        TypeError,
        ValueError,
        OverflowError,
        AttributeError,
        OSError,
    ) as error:
        raise InputError(
            f"not a set of films: {error!r}", where=str(folder), fix="restore the folder"
        ) from error
