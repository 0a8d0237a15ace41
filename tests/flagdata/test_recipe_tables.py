"""A dataclass read off a table: by its fields' types, its defaults, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal

import numpy as np
import pytest
from msgspec import Meta

from flagdata.errors import InputError, LimitError, UnknownNameError
from flagdata.recipes.typed_tables import (
    Angle,
    AngleQuantity,
    Count,
    Named,
    NotNegative,
    Positive,
    Quantity,
    Range,
    Spelled,
    read,
)


class Kind(StrEnum):
    SMALL = "small"
    LARGE = "large"


@dataclass(frozen=True, kw_only=True)
class Part:
    weight: NotNegative


@dataclass(frozen=True, kw_only=True)
class Spec:
    name: str
    frame_rate: Positive = 25.0
    count: Count = 3
    total: int = 0
    open: bool = False
    kind: Kind = Kind.SMALL
    kinds: tuple[Kind, ...] = ()
    sign: Literal["from", "to"] = "from"
    speed: Annotated[Quantity, Meta(ge=0.0, le=100.0)] = 4.0
    damping: Range | None = None
    height: Positive | None = None
    rates: tuple[float, ...] = ()
    points: tuple[tuple[float, float], ...] = ()
    words: tuple[str, ...] = ()
    codes: Spelled = ()
    column: str | Annotated[int, Meta(ge=1, le=9)] = 1
    renderer: Annotated[str, Named("renderer", ("cycles", "raster"))] = "raster"
    toward: AngleQuantity = 0.0
    north: Angle | None = None
    parts: tuple[Part, ...] = ()
    by_name: Mapping[Annotated[str, Named("side", ("train", "test"))], Part]
    mine: str = ""


def spec(**content: object) -> Spec:
    return read(Spec, {"name": "a", **content}, where="recipe", mine="mine")


def test_what_no_key_states_is_the_classes_default() -> None:
    assert spec() == Spec(name="a", by_name={}, mine="mine")


def test_every_type_of_field_is_read() -> None:
    content = {
        "frame-rate": np.float64(50),
        "count": 7,
        "open": True,
        "kind": "large",
        "sign": "to",
        "speed": {"low": 1, "high": 2},
        "damping": 3,
        "height": 2,
        "rates": [1, 2.5],
        "words": ["x"],
        "kinds": ["large"],
        "total": 4,
        "points": [[0, 1]],
        "codes": [" X", -9],
        "column": "speed",
        "renderer": "cycles",
        "toward-deg": {"low": 0, "high": 180},
        "north": 1,
        "parts": [{"weight": 1}],
        "by-name": {"train": {"weight": 2}},
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
        kinds=(Kind.LARGE,),
        total=4,
        points=((0.0, 1.0),),
        codes=("X", "-9"),
        column="speed",
        renderer="cycles",
        toward=Range(low=0.0, high=math.pi),
        north=1.0,
        parts=(Part(weight=1.0),),
        by_name={"train": Part(weight=2.0)},
        mine="mine",
    )


@pytest.mark.parametrize(
    ("content", "kind", "what"),
    [
        (
            {"frame-rat": 1.0, "count": "many"},
            UnknownNameError,
            "did you mean 'frame-rate'",
        ),  # before any value
        ({"frame-rate": 0}, InputError, "above 0"),
        ({"height": -1}, InputError, "above 0"),
        ({"count": 0}, InputError, "at least 1"),
        ({"count": 2.5}, InputError, "whole number"),
        ({"count": 10**7}, LimitError, "at most 1000000"),
        ({"kind": "larg"}, UnknownNameError, "did you mean 'large'"),
        ({"open": 1}, InputError, "true or false"),
        ({"speed": {"low": 1}}, InputError, "recipe speed: the key high is missing"),
        ({"words": "x"}, InputError, r'a list, \["…", …\]'),
        ({"name": " "}, InputError, "the key name is missing"),
        ({"total": -1}, InputError, "at least 0"),
        ({"total": 10**30}, LimitError, "at most 1000000"),
        ({"frame-rate": 10**400}, InputError, "frame-rate is 1000"),
        ({"frame-rate": math.inf}, InputError, "frame-rate is inf"),
        ({"rates": [1.0, math.nan]}, InputError, "rates is"),
        ({"count": True}, InputError, "whole number"),
        ({"kinds": ["larg"]}, UnknownNameError, "did you mean 'large'"),
        ({"sign": "at"}, InputError, 'give "from" or "to"'),
        ({"speed": {"low": 1, "high": 101}}, InputError, "at most 100"),
        (
            {"speed": {"low": 2, "high": 1}},
            InputError,
            "recipe speed: the range from 2.0 to 1.0 is empty",
        ),
        ({"speed": {"low": 1, "high": 2, "scale": "lg"}}, UnknownNameError, "did you mean 'log'"),
        ({"points": [[0]]}, InputError, r"a list, \[\[0.0, 0.0\], …\]"),
        (
            {"column": 10},
            InputError,
            "text in quotes or a whole number of at least 1 and of at most 9",
        ),
        (
            {"renderer": "rastr"},
            UnknownNameError,
            "unknown renderer 'rastr'; did you mean 'raster'",
        ),
        ({"toward": 10.0}, InputError, "toward-deg = 10"),
        ({"toward": 1.0, "toward-deg": 1.0}, InputError, "toward is given twice"),
        ({"north": {"low": 0, "high": 1}}, InputError, "north is"),
        ({"parts": {}}, InputError, "parts is"),
        (
            {"parts": [{"weight": 1}, {"wight": 1}]},
            UnknownNameError,
            r"recipe \[\[parts\]\] 2: unknown key 'wight'",
        ),
        (
            {"by-name": {"tran": {}}},
            UnknownNameError,
            r"recipe \[by-name\]: unknown side 'tran'; did you mean 'train'",
        ),
        (
            {"by-name": {"train": {}}},
            InputError,
            r"recipe \[by-name\] \[train\]: the key weight is missing",
        ),
        ({"by-name": {"train": 3}}, InputError, r"recipe \[by-name\] \[train\]: 3 is not a table"),
    ],
)
def test_what_does_not_fit_is_refused(
    content: dict[str, object], kind: type[Exception], what: str
) -> None:
    with pytest.raises(kind, match=what):
        spec(**content)
