"""What every effect on the cloth costs: time of a batch with it over that of the base model, on one
core.

Flags of 651 vertices in 4 to 5.5 m/s, batch 16, float32; the effect as drawn from its prior. Each
run with the effect follows one of the base model from the same state over the same steps; given are
medians of the ratios of processor time. Four methods: leapfrog, the same with layers kept apart by
contact, backward Euler in steps of 5 ms, and the split method of forecasts. The last row is Stokes'
air, which has no C++.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import torch

from flagdata.core.rng import stream
from sim.cloth.air import Stokes
from sim.cloth.contact import Contact
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, apply
from sim.integrate import BackwardEuler, SplitEuler, Symplectic, advance

BATCH = 16
STEPS = 60
PAIRS = 7
STOKES = "stokes air"
LENGTH = 0.02
"""Of the runs of the methods with long steps [s]."""
Method = Callable[[System, State], State]


def run(*, seed: int, out: object) -> dict[str, Any]:
    """Ratios to the base model by effect and method, and the base model's own times [µs a flag and
    step].

    Args:
        seed: of the effects' values.
        out: nothing is written into it.
    """
    del out
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.no_grad():
            return _ratios(seed)
    finally:
        torch.set_num_threads(threads)


def _ratios(seed: int) -> dict[str, Any]:
    speeds = [4.0 + 0.1 * b for b in range(BATCH)]
    system, state = assemble(
        [
            flag(material=named_material("camel-ponte-roma"), wind_speed=s, columns=30)
            for s in speeds
        ]
    )
    state = Symplectic().advance(system, state, 0.4)
    whole = Symplectic().steps(system, 0.04)
    leapfrog = partial(_leapfrog, 0.04 * STEPS / whole)
    methods: dict[str, tuple[Method, int]] = {
        "leapfrog": (leapfrog, STEPS),
        "leapfrog-contact": (leapfrog, STEPS),
        "backward-euler": (lambda s, x: BackwardEuler(tolerance=1e-4).advance(s, x, LENGTH), 4),
        "split": (lambda s, x: SplitEuler().advance(s, x, LENGTH), 4),
    }
    result: dict[str, Any] = {
        "batch": BATCH,
        "vertices": system.cloth.mesh.vertex_count,
        "pairs": PAIRS,
    }
    bases = {
        method: replace(system, contact=Contact()) if method == "leapfrog-contact" else system
        for method in methods
    }
    for method, (work, steps) in methods.items():
        base = statistics.median(_seconds(work, bases[method], state) for _ in range(PAIRS))
        result[f"{method}_us_a_flag_step"] = 1e6 * base / BATCH / steps
    rows: list[dict[str, Any]] = []
    for name in (*EFFECTS, STOKES):
        row: dict[str, Any] = {"effect": name}
        for method, (work, _) in methods.items():
            base = bases[method], state
            changed = _changed(name, seed, *base)
            if (
                work(*changed).healthy().all()
            ):  # more damping needs shorter steps than the base model's
                row[method] = _ratio(work, base, changed)
        rows.append(row)
    return result | {"effects": rows}


def _changed(name: str, seed: int, system: System, state: State) -> tuple[System, State]:
    if name == STOKES:
        return replace(system, air=Stokes()), state
    return apply([EFFECTS[name].drawn(stream(seed, name), batch=BATCH)], system, state)


def _leapfrog(duration: float, system: System, state: State) -> State:
    return advance(system, state, duration, steps=STEPS)


def _ratio(work: Method, base: tuple[System, State], changed: tuple[System, State]) -> float:
    """Median of the ratios of paired runs; fewer of them where one takes long."""
    work(*changed)  # what is built once for a system
    ratios: list[float] = []
    for _ in range(PAIRS):
        before = _seconds(work, *base)
        after = _seconds(work, *changed)
        ratios.append(after / before)
        if after > 2.0:
            break
    return statistics.median(ratios)


def _seconds(work: Method, system: System, state: State) -> float:
    began = time.process_time()
    work(system, state)
    return time.process_time() - began
