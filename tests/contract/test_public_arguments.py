"""Every public call takes a whole number of any library as Python's own, or refuses it; new calls
are held to it."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch

import flagdata
import flagdata.dataset
from flagdata.core.arguments import check_arguments, plain, real, whole
from flagdata.core.rng import stream
from flagdata.dataset import PairLoader, Sample
from flagdata.dataset.loader import Batchable
from flagdata.errors import UsageError

_WHOLE = re.compile(r"(?:int(?: \| None)?|tuple\[int(?:, int)*\](?: \| None)?)")
_MADE_INSIDE = {"Pairs.__init__"}
"""Made by `Source.pairs`, with what that has checked."""


def public_calls() -> Iterator[tuple[str, Callable[..., Any]]]:
    """The calls of `flagdata`, and those of the classes of `flagdata.dataset`; dataclasses are what
    they return."""
    for name in flagdata.__all__:
        yield name, getattr(flagdata, name)
    for name in flagdata.dataset.__all__:
        one = getattr(flagdata.dataset, name)
        if not inspect.isclass(one):
            yield name, one
            continue
        for method, call in vars(one).items():
            own = not method.startswith("_") or method == "__getitem__"
            if inspect.isfunction(call) and (
                own or (method == "__init__" and not dataclasses.is_dataclass(one))
            ):
                yield f"{name}.{method}", call


def numbered(call: Callable[..., Any]) -> frozenset[str]:
    """Names of the parameters that are whole numbers, by their annotations."""
    parameters = inspect.signature(call).parameters.values()
    return frozenset(one.name for one in parameters if _WHOLE.fullmatch(str(one.annotation)))


NUMBERED = {
    name: (call, names)
    for name, call in public_calls()
    if name not in _MADE_INSIDE and (names := numbered(call))
}


def test_the_calls_that_count_are_found() -> None:
    assert {"pairs", "measure", "simulate", "PairLoader.order_hash", "Pairs.__getitem__"} <= set(
        NUMBERED
    )


@pytest.mark.parametrize("name", NUMBERED)
def test_whole_numbers_of_every_public_call_are_checked_at_its_door(name: str) -> None:
    call, names = NUMBERED[name]
    assert names <= getattr(call, "converts", frozenset()), f"put @checked before {name}"


THREE = {
    "int": 3,
    "int64": np.int64(3),
    "uint8": np.uint8(3),
    "array": np.array(3),
    "tensor": torch.tensor(3),
    "series": pd.Series([3]).iloc[0],
}
NOT_WHOLE = {
    "True": True,
    "bool_": np.bool_(True),
    "tensor of truth": torch.tensor(True),
    "text": "3",
    "bytes": b"3",
    "float": 3.0,
    "float64": np.float64(3),
    "float tensor": torch.tensor(3.0),
    "decimal": Decimal(3),
    "fraction": Fraction(3),
    "list": [3],
    "arrays": np.array([3, 4]),
    "span": np.timedelta64(3, "s"),
    "date": np.datetime64(3, "ns"),
    "pandas' span": pd.Timedelta("3s"),
    "none": None,
    "nan": float("nan"),
}
"""What is refused: a truth value counts nothing, and a number with a point may have been
rounded."""


@pytest.mark.parametrize("kind", THREE)
def test_a_whole_number_is_pythons_own(kind: str) -> None:
    found = whole(THREE[kind], "seed")
    assert (type(found), found) == (int, 3)


@pytest.mark.parametrize("kind", NOT_WHOLE)
def test_what_is_no_whole_number_is_refused_by_the_name_of_the_argument(kind: str) -> None:
    with pytest.raises(UsageError, match=r"seed is .*no whole number"):
        whole(NOT_WHOLE[kind], "seed")


@pytest.mark.parametrize(
    "value", [0.2, np.float64(0.2), np.float32(0.2), torch.tensor(0.2), Decimal("0.2")]
)
def test_a_number_is_the_one_that_was_written(value: object) -> None:
    assert real(value, "start") == 0.2


@pytest.mark.parametrize(
    "value", [True, "0.2", None, np.timedelta64(1, "s"), np.array([0.2]), pd.Timestamp(0)]
)
def test_what_is_no_number_is_refused_by_the_name_of_the_argument(value: object) -> None:
    with pytest.raises(UsageError, match=r"start is .*no number"):
        real(value, "start")


def test_numbers_within_tables_become_pythons_own_and_arrays_stay() -> None:
    array = np.arange(3)
    found = plain(
        {
            "frames": np.int64(5),
            "speed": {"low": np.float32(2.5)},
            "at": [torch.tensor(1)],
            "time": array,
        }
    )
    assert json.dumps({key: value for key, value in found.items() if key != "time"})
    assert found["time"] is array


def test_a_table_of_another_library_is_refused_by_the_name_of_the_argument() -> None:
    with pytest.raises(UsageError, match=r"where is .*no table"):
        flagdata.query("lake", pd.Series({"kind": "clip"}))  # type: ignore[arg-type]
    with pytest.raises(UsageError, match=r"wind is 5\.0"):
        flagdata.simulate(wind=5.0)  # type: ignore[arg-type]


class Path3:
    """A path of another library."""

    def __fspath__(self) -> str:
        return "film.mp4"


@pytest.mark.parametrize(
    "given",
    [
        "film.mp4",
        np.str_("film.mp4"),
        b"film.mp4",
        Path("film.mp4"),
        PurePosixPath("film.mp4"),
        Path3(),
    ],
)
def test_whatever_names_a_path_is_that_path(given: object) -> None:
    @check_arguments
    def call(source: Path | str) -> Path:
        return Path(source)

    assert call(given) == Path("film.mp4")  # type: ignore[arg-type]


class Numbers(Batchable):
    """Samples that nobody reads: the order is looked at alone."""

    at, fingerprint = None, "made"

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def __len__(self) -> int:
        return 20

    def __getitem__(self, index: int) -> Sample:
        raise NotImplementedError


@pytest.mark.parametrize("kind", THREE)
def test_an_order_is_that_of_the_number_whatever_its_kind(kind: str) -> None:
    three = THREE[kind]
    loader = PairLoader(Numbers(three), batch_size=three, share=(np.int64(0), np.int64(1)))  # type: ignore[arg-type]
    known = PairLoader(Numbers(3), batch_size=3)
    assert loader.order_hash(three) == known.order_hash(3)  # type: ignore[arg-type]
    assert loader.batches(three) == known.batches(3)  # type: ignore[arg-type]
    loader.epoch = three  # type: ignore[assignment]  # as training loops set it
    known.epoch = 3
    assert json.dumps(loader.state_dict()) == json.dumps(known.state_dict())


@pytest.mark.parametrize("kind", THREE)
def test_a_stream_is_that_of_the_number_whatever_its_kind(kind: str) -> None:
    three = THREE[kind]
    drawn = stream(three, "order", three).random(3)  # type: ignore[arg-type]
    assert drawn.tolist() == stream(3, "order", 3).random(3).tolist()
    assert drawn.tolist() != stream(3, "order", "3").random(3).tolist()
