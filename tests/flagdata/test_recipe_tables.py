"""A dataclass read off a table: by its fields' types, its defaults, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import pytest

from flagdata.errors import InputError, LimitError, UnknownNameError
from flagdata.tables import COUNT, POSITIVE, Quantity, Range, Table


class Kind(StrEnum):
    SMALL = "small"
    LARGE = "large"


@dataclass(frozen=True, kw_only=True)
class Spec:
    name: str
    frame_rate: float = 25.0
    count: int = 3
    open: bool = False
    kind: Kind = Kind.SMALL
    sign: Literal["from", "to"] = "from"
    speed: Quantity = 4.0
    damping: Range | None = None
    height: float | None = None
    rates: tuple[float, ...] = ()
    words: tuple[str, ...] = ()
    own: str = ""


def spec(**content: object) -> Spec:
    table = Table({"name": "a", **content}, where="recipe")
    return table.record(Spec, {"own": lambda: "mine"}, frame_rate=POSITIVE, count=COUNT, height=POSITIVE)


def test_what_no_key_states_is_the_classes_default() -> None:
    assert spec() == Spec(name="a", own="mine")


def test_every_type_of_field_is_read() -> None:
    content = {
        "frame-rate": 50,
        "count": 7,
        "open": True,
        "kind": "large",
        "sign": "to",
        "speed": {"low": 1, "high": 2},
        "damping": 3,
        "height": 2,
        "rates": [1, 2.5],
        "words": ["x"],
    }
    assert spec(**content) == Spec(
        name="a",
        frame_rate=50.0,
        count=7,
        open=True,
        kind=Kind.LARGE,
        sign="to",
        speed=Range(low=1.0, high=2.0),
        damping=Range(low=3.0, high=3.0),
        height=2.0,
        rates=(1.0, 2.5),
        words=("x",),
        own="mine",
    )


@pytest.mark.parametrize(
    ("content", "kind", "what"),
    [
        ({"frame-rat": 1.0, "count": "many"}, UnknownNameError, "did you mean 'frame-rate'"),  # before any value
        ({"frame-rate": 0}, InputError, "above 0"),
        ({"height": -1}, InputError, "above 0"),
        ({"count": 0}, InputError, "at least 1"),
        ({"count": 2.5}, InputError, "whole number"),
        ({"count": 10**7}, LimitError, "at most 1000000"),
        ({"kind": "larg"}, UnknownNameError, "did you mean 'large'"),
        ({"open": 1}, InputError, "true or false"),
        ({"speed": {"low": 1}}, InputError, "low"),
        ({"words": "x"}, InputError, "list of texts"),
        ({"name": " "}, InputError, "no name"),
    ],
)
def test_what_does_not_fit_is_refused(content: dict[str, object], kind: type[Exception], what: str) -> None:
    with pytest.raises(kind, match=what):
        spec(**content)


def test_a_name_of_several_is_known_or_the_nearest_is_suggested() -> None:
    table = Table({"renderer": "rastr"}, where="recipe")
    assert table.named("other", "cycles", ("cycles", "raster"), noun="renderer") == "cycles"
    with pytest.raises(UnknownNameError, match="did you mean 'raster'"):
        table.named("renderer", "cycles", ("cycles", "raster"), noun="renderer")
