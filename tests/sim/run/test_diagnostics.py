"""Sheets without damping: where their energy comes from, and how they end."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from sim.cloth.air import NO_AIR
from sim.cloth.material import Material, isotropic, named_material
from sim.cloth.scene import assemble, flag
from sim.integrate import Symplectic, advance
from sim.run import CRUMPLED, Crew, Stepper, parse, run
from sim.run.member_batch import Monitor

PONTE_ROMA = replace(named_material("camel-ponte-roma"), damping=0.0)
CONSTANT = isotropic(
    name="constant",
    area_weight=PONTE_ROMA.area_weight,
    stretching=float(PONTE_ROMA.stretching.max()),
    shear=float(PONTE_ROMA.stretching.max()),
    bending=float(PONTE_ROMA.bending.mean()),
    damping=0.0,
)


def falling(material: Material, *, finer: int) -> tuple[float, float]:
    """Late compression, and the energy after 2 s, of an undamped flag let go without air, in so
    much finer steps."""
    scene = replace(flag(material=material, wind_speed=0.0, columns=12), air=NO_AIR)
    scene = replace(
        scene,
        position=scene.position + np.random.default_rng(0).normal(0, 1e-4, scene.position.shape),
    )
    system, state = assemble([scene], dtype=torch.float64)
    steps = finer * Symplectic().steps(system, 0.04)
    monitor = Monitor()
    with torch.no_grad():
        for _ in range(50):
            state = advance(system, state, 0.04, steps=steps)
            monitor.look(system, state)
    diagnosis = monitor.of(0)
    return diagnosis.late_compression, sum(values[-1] for values in diagnosis.energies.values())


@pytest.mark.parametrize("finer", [2, 4])
def test_without_damping_the_tables_make_energy_whatever_the_step_and_constant_stiffness_does_not(
    finer: int,
) -> None:
    # At the start the flag is at rest 0.5 m, on the average, above its lowest handle: at most 2.1 J
    # to be had.
    weight = 1.5 * PONTE_ROMA.area_weight * 9.81
    compression, energy = falling(PONTE_ROMA, finer=finer)
    assert compression > CRUMPLED
    assert energy > 20 * weight * 0.5
    compression, energy = falling(CONSTANT, finer=finer)
    assert compression < 0.1
    assert energy == pytest.approx(weight * 0.5, rel=0.02)


UNDAMPED = """
count = 4
batch = 4
[scene]
columns = 12
start-noise = 1e-4
[material]
name = "camel-ponte-roma"
damping = 0.0
[integrator]
step = {step}
[wind]
speed = 4.0
[time]
settle = 3.6
frames = 8
"""


@pytest.mark.parametrize(("step", "kinds"), [(6e-4, {"crumpled"}), (1.5e-3, {"diverged"})])
def test_undamped_flags_crumple_and_in_steps_near_the_limit_diverge_and_neither_is_stored(
    step: float, kinds: set[str]
) -> None:
    # The limit is 1.7 ms; the automatic step is 0.7 of it, where some diverge and some do not.
    recipe = parse(UNDAMPED.format(step=step), name="r", folder=Path(), where="r")
    crew = Crew(recipe)
    outcomes = run(crew, Stepper.of(crew), [crew.member(index) for index in range(4)], size=4)
    assert {outcome.failure[0] if outcome.failure else None for outcome in outcomes} == kinds
    assert all(outcome.sequence is None for outcome in outcomes)
