"""Keys: what is undeclared in a set, and how it was made. Sealed by a hash until the verdict is
filed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from flagdata.core.provenance import canonical, digest
from flagdata.errors import CorruptError
from tests.studies.challenge.recipe import Kind


@dataclass(frozen=True, kw_only=True)
class Acting:
    """An effect that acts in a set.

    Attributes:
        effect: its name.
        parameter: the strength that was drawn.
        value: of it, in its own unit.
        unit: SI.
    """

    effect: str
    parameter: str
    value: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class AnswerKey:
    """What a participant must find out about a set.

    Attributes:
        name: of the set.
        kind: of what is undeclared.
        effects: that act.
        impact: root mean square displacement of the cloth, over its vertices and six instants of
            each recording, that the effects make within 0.1 s of a common state [m]; 0 where there
            are none. The one measure of strength that all effects share.
        material: nominal.
        density, bending: factors on it.
        damping: [s].
        speeds: of the recordings, in their order [m/s].
        toward: where the wind goes, counter-clockwise from +x [rad].
        heading: from the pole to where the flag starts, from there [rad].
        intensity: of logged turbulence; 0 for steady winds.
        rate: frames a second [Hz].
        noise: standard deviation of a marker's coordinate [m].
        numerics: name of the generator's.
    """

    name: str
    kind: Kind
    effects: tuple[Acting, ...]
    impact: float
    material: str
    density: float
    bending: float
    damping: float
    speeds: tuple[float, ...]
    toward: float
    heading: float
    intensity: float
    rate: int
    noise: float
    numerics: str

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        return {"schema": "flagdata.challenge-key/1", **asdict(self)}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> AnswerKey:
        """From `as_dict`."""
        values = {name: value for name, value in content.items() if name != "schema"}
        values["kind"] = Kind(values["kind"])
        values["effects"] = tuple(Acting(**entry) for entry in values["effects"])
        values["speeds"] = tuple(values["speeds"])
        return cls(**values)


def seal(key: AnswerKey, salt: str) -> str:
    """What is published of a key: the SHA-256 of its canonical JSON with a salt, so that it cannot
    be guessed."""
    return digest(canonical({"key": key.as_dict(), "salt": salt}))


def opened(content: Mapping[str, Any], commitment: str, *, where: str) -> AnswerKey:
    """The key of a sealed file, once it is found to be the one that was published.

    Raises:
        CorruptError: it is another.
    """
    try:
        key = AnswerKey.from_dict(content["key"])
        found = seal(key, str(content["salt"]))
    except (KeyError, TypeError, ValueError) as error:
        raise CorruptError(
            f"not a sealed key: {error}", where=where, fix="restore the file"
        ) from error
    if found != commitment:
        raise CorruptError(
            "the key is not the one whose hash was published",
            where=where,
            fix="restore the sealed file as it was made",
        )
    return key
