"""Recordings of one cloth, each with what is unknown of its place alone, in normal scores.

A coordinate is a normal score of one quantity's prior, in which that prior is standard normal: first the cloth's, then
those of each place. Recordings from one place with one anemometer share gain and view.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from scipy.special import ndtr

from flagdata.arrays import FloatArray
from measure.calibrate.prior import CLOTH, NUISANCES, Uncertain

BESIDE = ("gain", "scale")
"""Nuisances that are fitted beside the place."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed:
    """A recording as far as its place is concerned.

    Attributes:
        azimuth, elevation: their priors.
        place: what recordings from one place with one anemometer share; None for a place of its own.
    """

    azimuth: Uncertain
    elevation: Uncertain
    place: str | None = None

    @property
    def quantities(self) -> tuple[Uncertain, ...]:
        """That are fitted for it alone: gain, scale, azimuth and elevation."""
        return (*(one for one in NUISANCES if one.name in BESIDE), self.azimuth, self.elevation)


def first_of(places: Sequence[str | None]) -> list[int]:
    """For each recording the first one of its place; None is a place of its own."""
    return [number if name is None else list(places).index(name) for number, name in enumerate(places)]


def dimension(sights: Sequence[Placed]) -> int:
    """Coordinates of the cloth and of all places."""
    return len(CLOTH) + sum(len(sights[first].quantities) for first in set(first_of([one.place for one in sights])))


def values(scores: FloatArray, sights: Sequence[Placed]) -> tuple[dict[str, FloatArray], list[dict[str, FloatArray]]]:
    """Cloths, and places of each recording, at normal scores (n, dimension or more)."""
    shares: Iterator[FloatArray] = iter(ndtr(scores).T)
    cloth = {one.name: one.at(next(shares)) for one in CLOTH}
    owners = first_of([one.place for one in sights])
    own = {first: {one.name: one.at(next(shares)) for one in sights[first].quantities} for first in sorted(set(owners))}
    return cloth, [own[first] for first in owners]
