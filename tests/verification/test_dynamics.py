"""Verification 4 and 5: pendulum modes of a hanging sheet, and the terminal velocity of a falling one."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy.special import j0, jn_zeros

from sim.air import QuadraticNormal
from sim.handles import Handles
from sim.integrate.stability import stable_step
from sim.integrate.symplectic import advance
from sim.material import isotropic
from sim.mesh import grid
from sim.state import State

G = 9.81


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_hanging_sheet_swings_at_the_bessel_frequencies(mode: int, build) -> None:
    # A chain or sheet without bending stiffness: ω_n = (j_{0,n}/2) √(g/L), shape J0(j_{0,n} √(z/L)), z from the free
    # end (Bernoulli 1733; Lamb, Higher Mechanics). The chain of rows with lumped masses is of second order in 1/rows.
    length, rows = 1.0, 30
    mesh = grid(width=0.1, height=length, columns=1, rows=rows)
    top = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 1] > length - 1e-9))
    material = isotropic(name="limp", density=0.2, stretching=2000.0, shear=2000.0, bending=0.0)
    system, state = build(mesh, [material], handles=Handles(vertices=top, stiffness=math.inf), gravity=(0.0, 0.0, -G))
    root = float(jn_zeros(0, mode)[-1])
    shape = torch.tensor(j0(root * np.sqrt(mesh.rest[:, 1] / length)))
    # Hung at its static stretch ρ g (L − s)/K, so that it does not bounce: displacement ρ g (L s − s²/2)/K downwards.
    below = length - torch.tensor(mesh.rest[:, 1])
    sag = 0.2 * G / 2000.0 * (length * below - below**2 / 2)
    position = state.position.clone()
    position[:, 2, 0] -= sag
    position[:, 0, 0] = 1e-4 * length * shape
    state = State(position=position, velocity=state.velocity)
    omega = root / 2 * math.sqrt(G / length)
    weight = system.cloth.mass[:, 0] * shape
    sample = 2 * math.pi / omega / 40
    steps = math.ceil(sample / (0.7 * stable_step(system)))
    projections = []
    for _ in range(120):
        projections.append(float((weight * state.position[:, 0, 0]).sum()))
        state = advance(system, state, sample, steps=steps)
    signal = np.array(projections)
    crossing = np.flatnonzero(np.signbit(signal[1:]) != np.signbit(signal[:-1]))
    times = (crossing + signal[crossing] / (signal[crossing] - signal[crossing + 1])) * sample
    measured = math.pi * (len(times) - 1) / (times[-1] - times[0])
    # Second order: the error grows with the square of the mode's wavenumber.
    assert measured == pytest.approx(omega, rel=0.0025 * mode**2)


def test_falling_sheet_reaches_terminal_velocity(build) -> None:
    # m dv/dt = m g − ρ A v²: v = v_t tanh(g t / v_t), v_t = √(ρ_s g / ρ); the fall is (v_t²/g) ln cosh(g t / v_t).
    # The air sees the velocity half a step back: first order in the step.
    density, air = 0.15, 1.2
    mesh = grid(width=0.3, height=0.3, columns=3, rows=3)
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    material = isotropic(name="sheet", density=density, stretching=50.0, shear=50.0, bending=1e-4)
    terminal = math.sqrt(density * G / air)
    duration = 0.3

    def error(steps: int) -> tuple[float, float]:
        system, state = build(mesh, [material], position=flat, gravity=(0.0, 0.0, -G), air=QuadraticNormal(density=air))
        final = advance(system, state, duration, steps=steps)
        speed = -float((system.cloth.mass[:, 0] * final.velocity[:, 2, 0]).sum() / system.cloth.mass.sum())
        fall = -float((system.cloth.mass[:, 0] * final.position[:, 2, 0]).sum() / system.cloth.mass.sum())
        share = G * duration / terminal
        return (
            abs(speed - terminal * math.tanh(share)),
            abs(fall - terminal**2 / G * math.log(math.cosh(share))),
        )

    coarse, fine = error(400), error(800)
    assert max(fine) < 1e-3
    assert 0.9 < math.log2(coarse[1] / fine[1]) < 1.1
    assert math.tanh(G * duration / terminal) > 0.98
