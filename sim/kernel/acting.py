"""Hands what acts beside the base model to the compiled kernel."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.cloth_batch import Cloth
from sim.cloth.system import System
from sim.compiler import of_effect
from sim.kernel.effect_code import Compilable, Given, header


class Kind(IntEnum):
    """Where an effect enters the equations, as effect.hpp numbers it."""

    PRESSURE_FACTOR = 0
    FACE_FORCE = 1
    FLOW = 2
    SHEET_FORCE = 3
    HINGE_MOMENT = 4


_FORCES = (Kind.FACE_FORCE, Kind.SHEET_FORCE, Kind.HINGE_MOMENT)


class ActingEntry(ctypes.Structure):
    """Mirrors `Effect` of problem.hpp field by field."""

    _fields_ = [
        ("kind", ctypes.c_int64),
        ("act", ctypes.c_void_p),
        ("numbers", ctypes.c_int64),
        ("own", ctypes.c_int64),
        ("number", ctypes.c_void_p),
        ("of_element", ctypes.c_void_p),
        ("memory", ctypes.c_void_p),
    ]


@dataclass(frozen=True, kw_only=True)
class Acting:
    """All that acts beside the base model of a system.

    Attributes:
        entries: in the order of factors on the pressure, flows, forces and those forces that
            remember.
        remembering: how many of them, at the end, remember.
        tensors: what the entries point to, kept alive here.
    """

    entries: Sequence[ActingEntry]
    remembering: int
    tensors: list[Tensor] = field(repr=False)

    def with_memory(self, memory: Sequence[Tensor]) -> ctypes.Array[ActingEntry]:
        """Returns the entries with what forces remember, which is changed in place and must outlive
        the entries."""
        array = (ActingEntry * len(self.entries))(*self.entries)
        for entry, past in zip(array[len(array) - self.remembering :], memory, strict=True):
            entry.memory = past.data_ptr()
        return array


def acting(system: System, kind: str, pack: Callable[[Tensor], Tensor]) -> Acting | None:
    """Compiles what acts beside the base model; None where any of it has no C++ beside it, or that
    cannot be built.

    Args:
        kind: of the kernel's functions, by numbers and lanes.
        pack: (…, batch) → (block, …, lane), contiguous.

    Raises:
        UsageError: C++ of a kind that does not fit where the effect enters the equations.
    """
    entries: list[ActingEntry] = []
    tensors: list[Tensor] = []
    for part, fitting in _parts(system):
        built = None if part is None else _compiled_effect(part, system.cloth, kind, fitting)
        if built is None:
            return None
        given, number, act = built
        cloth = system.cloth
        numbers = [torch.as_tensor(n, dtype=cloth.dtype).expand(cloth.batch) for n in given.numbers]
        numbers = pack(torch.stack(numbers) if numbers else cloth.mass[:0])
        entry = ActingEntry(
            kind=number, act=act, numbers=numbers.shape[1], number=numbers.data_ptr()
        )
        tensors.append(numbers)
        if given.own is not None:
            of_elements = pack(given.own)
            entry.own, entry.of_element = of_elements.shape[2], of_elements.data_ptr()
            tensors.append(of_elements)
        entries.append(entry)
    return Acting(entries=entries, remembering=len(system.remembering), tensors=tensors)


def _parts(system: System) -> Iterator[tuple[Compilable | None, tuple[Kind, ...]]]:
    """Yields what acts beside the base model, None for what certainly has no C++; each with the
    kinds that it may be of."""
    factors = system.air.factors
    placed: list[tuple[Sequence[Any], tuple[Kind, ...]]] = [
        ((None,) if factors is None else factors, (Kind.PRESSURE_FACTOR,)),
        (system.flows, (Kind.FLOW,)),
        (system.effects, _FORCES),
        (system.remembering, (Kind.HINGE_MOMENT, Kind.FACE_FORCE)),
    ]
    for parts, fitting in placed:
        for part in parts:
            yield part if isinstance(part, Compilable) else None, fitting


def _compiled_effect(
    part: Compilable, cloth: Cloth, kind: str, fitting: Sequence[Kind]
) -> tuple[Given, int, int] | None:
    """Loads an effect's C++ function: what it reads, its kind and its address."""
    given = part.given(cloth)
    source = header(given.of)
    code = None if source is None else of_effect(source)
    function = None if code is None else getattr(code, f"{given.of.__name__}_{kind}", None)
    if function is None:
        return None
    number = Kind(getattr(code, f"{given.of.__name__}_kind")())
    if number not in fitting:
        raise UsageError(
            f"the C++ of {given.of.__name__} is of the kind {number.name}",
            where=str(source),
            fix=f"make it one of {', '.join(entry.name for entry in fitting)}",
        )
    function.restype = ctypes.c_void_p
    return given, number, function()
