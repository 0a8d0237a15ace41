"""Verification of MuJoCo's cloths against closed forms: as a source of truth it has to be right by
theory first."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch
from scipy.integrate import quad, solve_ivp
from scipy.special import j0

from flagdata.core.arrays import FloatArray
from flagdata.errors import NotFoundError
from sim.cloth import Cloth
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.effects import FiniteSpanLoading
from tests.studies.validation.environments import MUJOCO, UnusableError
from tests.studies.validation.mujoco.cloth import Air, Flight, Integrator, Method, Sheet, Wind, fly

STILL, CALM = Air(pressure=0.0), Wind()
GRAVITY = 9.81
METHODS = (Method(), Method(integrator=Integrator.DISCRETE, step=1e-3))


@pytest.fixture(scope="session")
def mujoco() -> Path:
    """The Python of MuJoCo's environment."""
    try:
        return MUJOCO.find()
    except NotFoundError as error:
        pytest.skip(f"{error.what}: {error.fix}")


def _level(sheet: Sheet) -> FloatArray:
    return np.concatenate([sheet.mesh.rest, np.zeros((len(sheet.mesh.rest), 1))], axis=1)


def _hanging(sheet: Sheet) -> FloatArray:
    """v from bottom to top, along z."""
    u, v = sheet.mesh.rest.T
    return np.stack([u, np.zeros_like(u), v], axis=1)


FREE = Sheet(
    mesh=grid(width=0.6, height=0.4, columns=6, rows=4),
    held=(),
    area_weight=0.284,
    stretching=80.0,
    poisson=0.2,
    bending=2e-5,
    damping=1e-3,
)


@pytest.mark.parametrize("method", METHODS)
def test_a_sheet_falls_freely_as_points_do(mujoco: Path, method: Method) -> None:
    made = fly(
        mujoco,
        FREE,
        start=_level(FREE),
        air=STILL,
        wind=CALM,
        method=method,
        rate=25.0,
        frames=11,
        gravity=GRAVITY,
    )
    # Velocity first, then position, in n steps of h: z = −g h² n (n + 1)/2.
    steps = np.arange(11) * round(0.04 / method.step)
    expected = -GRAVITY * method.step**2 * steps * (steps + 1) / 2
    np.testing.assert_allclose(
        made.positions[:, :, 2], np.repeat(expected[:, None], 35, axis=1), atol=1e-8
    )
    np.testing.assert_allclose(
        made.positions[:, :, :2], np.tile(FREE.mesh.rest, (11, 1, 1)), atol=1e-8
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_level_sheet_in_air_falls_towards_its_terminal_speed(
    mujoco: Path, method: Method
) -> None:
    """v = v∞ tanh(g t/v∞) with v∞ = √(σ g/p): mass and wind force in one, gravity on the vertices by their mass."""
    made = fly(
        mujoco,
        FREE,
        start=_level(FREE),
        air=Air(pressure=1.3),
        wind=CALM,
        method=method,
        rate=25.0,
        frames=21,
        gravity=GRAVITY,
    )
    terminal = math.sqrt(FREE.area_weight * GRAVITY / 1.3)
    expected = -terminal * np.tanh(GRAVITY * np.arange(21) * 0.04 / terminal)
    # Forces are those at the start of a step: late by half a step, h g/2 at most.
    np.testing.assert_allclose(
        made.velocities[:, :, 2].mean(axis=1), expected, atol=method.step * GRAVITY / 2
    )


def test_a_level_sheet_whose_pressure_lags_falls_as_wagners_function_has_it(mujoco: Path) -> None:
    """σ v̇ = −σ g + F − s Σ Aᵢ (F − zᵢ), F = p v², żᵢ = (2 |v|/L) bᵢ (F − zᵢ) with L = 0.6 m."""

    def speeds(air: Air) -> FloatArray:
        made = fly(
            mujoco,
            FREE,
            start=_level(FREE),
            air=air,
            wind=CALM,
            method=Method(),
            rate=25.0,
            frames=21,
            gravity=GRAVITY,
        )
        return made.velocities[:, :, 2].mean(axis=1)

    def rates(_: float, state: FloatArray) -> list[float]:
        speed, slow, fast = state
        load = 1.3 * speed * abs(speed)
        held_back = 0.165 * (load - slow) + 0.335 * (load - fast)
        tau = 2 * abs(speed) / 0.6
        return [
            GRAVITY - (load - 0.8 * held_back) / FREE.area_weight,
            tau * 0.0455 * (load - slow),
            tau * 0.3 * (load - fast),
        ]

    times = np.arange(21) * 0.04
    expected = -solve_ivp(rates, (0.0, 0.8), [0.0, 0.0, 0.0], t_eval=times, rtol=1e-9).y[0]
    lagging = speeds(Air(pressure=1.3, lag=0.8))
    late = Method().step * GRAVITY / 2  # forces are those at the start of a step
    np.testing.assert_allclose(lagging, expected, atol=late)
    assert np.abs(lagging - speeds(Air(pressure=1.3)))[5:].max() > 40 * late


def test_air_that_is_carried_slows_the_first_fall_of_a_level_sheet(mujoco: Path) -> None:
    """v = −g t σ/(σ + m e) before the sheet has bent: m of k = π/L, and e an ellipse of mean 1 over the height."""
    made = fly(
        mujoco,
        FREE,
        start=_level(FREE),
        air=Air(pressure=0.0, carried=0.9),
        wind=CALM,
        method=Method(step=1e-4),
        rate=1e3,
        frames=2,
        gravity=GRAVITY,
    )
    mass = 0.9 / ((math.pi / 0.6 / 2) ** 1.5 + (4 / (math.pi * 0.4)) ** 1.5) ** (2 / 3)
    ellipse = np.sqrt(np.clip(1 - (FREE.mesh.rest[:, 1] / 0.2 - 1) ** 2, 0, None))
    ellipse /= (ellipse * FREE.mesh.vertex_areas).sum() / FREE.mesh.vertex_areas.sum()
    expected = -GRAVITY * 1e-3 * FREE.area_weight / (FREE.area_weight + mass * ellipse)
    np.testing.assert_allclose(made.velocities[1, :, 2], expected, rtol=1e-3)


def test_air_that_is_carried_moves_by_mujocos_explicit_steps_alone(mujoco: Path) -> None:
    with pytest.raises(UnusableError, match="needs MuJoCo's integrator Euler"):
        fly(
            mujoco,
            FREE,
            start=_level(FREE),
            air=Air(carried=0.2),
            wind=CALM,
            method=METHODS[1],
            rate=25.0,
            frames=2,
        )


def test_the_inertia_of_the_air_about_a_still_wave_is_that_of_its_wavenumbers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """η = a cos k₄u in a stream U: √e Σ_b m(k₄, b π/H) cos(b π v/H) ⟨√e cos⟩_b U² k₄² η; and the library's mass."""
    monkeypatch.setitem(sys.modules, "mujoco", ModuleType("mujoco"))
    mesh = grid(width=1.5, height=1.0, columns=40, rows=28)
    carried = import_module("tests.studies.validation.mujoco.worker").Carried(
        0.3, mesh.rest, mesh.vertex_areas
    )
    u, v = mesh.rest.T
    along = 4 * np.pi / 1.5
    wave = 0.002 * np.cos(along * u)
    position = np.stack([u, wave, v], axis=1)
    found = carried.load(position, np.zeros_like(position), np.array([5.0, 0.0, 0.0]))

    def root(at: FloatArray) -> FloatArray:
        return np.sqrt(4 / np.pi * np.sqrt(np.clip(1 - (2 * at - 1) ** 2, 0, None)))

    places = (np.arange(4000) + 0.5) / 4000
    size = np.zeros_like(u)
    for b in range(14):
        part = (root(places) * np.cos(b * np.pi * places)).mean() * (1 if b == 0 else 2)
        k = math.hypot(along, b * np.pi)
        size += (
            0.3 * ((k / 2) ** 1.5 + (4 / np.pi) ** 1.5) ** (-2 / 3) * part * np.cos(b * np.pi * v)
        )
    expected = mesh.vertex_areas * root(v) * size * 25 * along**2 * wave
    assert np.linalg.norm(found[:, 1] - expected) < 0.05 * np.linalg.norm(expected)
    cloth = Cloth.build(mesh, [named_material("camel-ponte-roma")], dtype=torch.float64)
    own = FiniteSpanLoading(share=1.0, density=0.3).added_mass(cloth)[:, 0].numpy()
    np.testing.assert_allclose(carried.mass, own, rtol=1e-6)  # places are rounded to a nanometre


def test_the_wind_pushes_a_level_sheet_by_its_tangential_drag(mujoco: Path) -> None:
    """σ dv/dt = c (U − v): v = U (1 − exp(−c t/σ)) without gravity."""
    made = fly(
        mujoco,
        FREE,
        start=_level(FREE),
        air=Air(linear=0.4),
        wind=Wind(velocity=np.array([[3.0, 0.0, 0.0]])),
        method=Method(),
        rate=25.0,
        frames=11,
        gravity=0.0,
    )
    expected = 3.0 * -np.expm1(-0.4 * np.arange(11) * 0.04 / FREE.area_weight)
    # An explicit step of h errs by h c/(2 σ) of what changes.
    bound = 3.0 * 0.5e-3 * 0.4 / FREE.area_weight
    np.testing.assert_allclose(made.velocities[:, :, 0].mean(axis=1), expected, atol=bound)


@pytest.mark.parametrize("along", [0, 1])
def test_a_clamped_sheet_vibrates_as_an_elastic_beam(mujoco: Path, along: int) -> None:
    """ω = 1.8751² √(B/(σ L⁴)) (Euler–Bernoulli), started from its mode; without gravity, along either axis.

    Hinges that store D κ²/2 in a cylinder fold at the lines across it and not at the diagonals. A
    free strip of alternating diagonals folds at both, and so has B = 4/5 D (derived in
    `tests.verification.cases.drooped_tips`).
    """
    cells, length, rigidity, density = 40, 0.5, 0.005, 0.3
    size = {"width": length, "height": 0.025, "columns": cells, "rows": 2}
    if along:
        size = {"width": 0.025, "height": length, "columns": 2, "rows": cells}
    mesh = grid(**size)
    place = mesh.rest[:, along]
    held = tuple(np.flatnonzero(place < 1.5 * length / cells).tolist())
    sheet = Sheet(mesh=mesh, held=held, area_weight=density, stretching=200.0, bending=rigidity)
    beta, reach = 1.875104 / length, 0.734096
    s = place - length / cells
    mode = np.cosh(beta * s) - np.cos(beta * s) - reach * (np.sinh(beta * s) - np.sin(beta * s))
    start = _level(sheet)
    start[:, 2] = np.where(s > 1e-9, 2e-3 * mode, 0.0)
    made = fly(
        mujoco,
        sheet,
        start=start,
        reference=_level(sheet),
        air=STILL,
        wind=CALM,
        method=Method(step=0.2e-3),
        rate=50.0,
        frames=52,
        gravity=0.0,
    )
    tip = made.positions[:, place > length - 1e-9, 2].mean(axis=1)
    down = np.flatnonzero((tip[:-1] > 0) & (tip[1:] <= 0))[0]
    crossing = (down + tip[down] / (tip[down] - tip[down + 1])) / 50.0
    # The held cell clamps the strip at its middle; the turn at the clamp is off by a fifth, an
    # error of first order.
    free = length * (1 - 0.5 / cells)
    period = 2 * math.pi / (1.875104**2 * math.sqrt(0.8 * rigidity / (density * free**4)))
    assert 4 * crossing == pytest.approx(period, rel=1 / cells)


@pytest.mark.parametrize("method", METHODS)
def test_a_hanging_sheet_sags_under_its_own_weight(mujoco: Path, method: Method) -> None:
    """The weight below a point is the tension there, Y λ (λ² − 1)/2 of a Saint Venant–Kirchhoff
    strip of stretch λ."""
    mesh = grid(width=0.05, height=1.0, columns=1, rows=20)
    top = tuple(np.flatnonzero(mesh.rest[:, 1] > 1 - 1e-9).tolist())
    sheet = Sheet(
        mesh=mesh, held=top, area_weight=0.3, stretching=20.0, bending=1e-6, damping=20e-3
    )
    made = fly(
        mujoco,
        sheet,
        start=_hanging(sheet),
        air=STILL,
        wind=CALM,
        method=replace(method, step=method.step / 2),
        rate=5.0,
        frames=1,
        settle=20,
        gravity=GRAVITY,
    )

    def stretch(below: float) -> float:
        tension = sheet.area_weight * GRAVITY * below
        return float(
            np.roots([sheet.stretching / 2, 0.0, -sheet.stretching / 2, -tension]).real.max()
        )

    length = quad(stretch, 0.0, 1.0)[0]
    bottom = made.positions[-1, mesh.rest[:, 1] < 1e-9, 2].mean()
    assert np.abs(made.velocities[-1]).max() < 1e-3  # at rest
    # Linear elements and lumped masses err by the square of a cell over the length, 1/400 of the 72
    # mm, with room.
    assert 1.0 - bottom == pytest.approx(length, abs=5e-4)


def test_a_hanging_strip_swings_with_the_period_of_a_chain(mujoco: Path) -> None:
    """Bernoulli's hanging chain: ω = (j₀,₁/2) √(g/L) with j₀,₁ = 2.4048, its shape J₀(j₀,₁
    √(s/L))."""
    mesh = grid(width=0.1, height=1.0, columns=1, rows=20)
    top = tuple(np.flatnonzero(mesh.rest[:, 1] > 1 - 1e-9).tolist())
    sheet = Sheet(
        mesh=mesh, held=top, area_weight=0.3, stretching=2000.0, bending=1e-8, damping=1e-4
    )
    start = _hanging(sheet)
    reference = start.copy()
    start[:, 1] = 0.01 * j0(2.40483 * np.sqrt(mesh.rest[:, 1]))
    made = fly(
        mujoco,
        sheet,
        start=start,
        reference=reference,
        air=STILL,
        wind=CALM,
        method=Method(step=0.2e-3),
        rate=50.0,
        frames=100,
        gravity=GRAVITY,
    )
    tip = made.positions[:, mesh.rest[:, 1] < 1e-9, 1].mean(axis=1)
    down = np.flatnonzero((tip[:-1] > 0) & (tip[1:] <= 0))[0]
    crossing = (down + tip[down] / (tip[down] - tip[down + 1])) / 50.0
    # A lumped chain of 20 is faster than a smooth one by about 1/(4·20²); crossings by lines
    # between frames.
    assert 4 * crossing == pytest.approx(2 * math.pi / (2.40483 / 2 * math.sqrt(GRAVITY)), rel=5e-3)


def test_a_swinging_sheet_without_losses_keeps_its_energy(mujoco: Path) -> None:
    """Semi-implicit Euler is symplectic: its energy wavers by the step and does not drift."""
    mesh = grid(width=0.5, height=0.5, columns=6, rows=6)
    sheet = Sheet(
        mesh=mesh, held=(0, 42), area_weight=0.284, stretching=80.0, poisson=0.2, bending=1e-7
    )
    u, v = mesh.rest.T
    start = np.stack([u * math.cos(0.5), u * math.sin(0.5), v], axis=1)
    made = fly(
        mujoco,
        sheet,
        start=start,
        air=STILL,
        wind=CALM,
        method=Method(step=0.2e-3),
        rate=25.0,
        frames=40,
        gravity=GRAVITY,
    )
    total = _energy(sheet, made)
    moving = _kinetic(sheet, made).max()
    assert moving > 0.15
    assert np.abs(total - total[0]).max() < 0.01 * moving
    lossy = fly(
        mujoco,
        replace(sheet, damping=5e-3),
        start=start,
        air=STILL,
        wind=CALM,
        method=Method(step=0.2e-3),
        rate=25.0,
        frames=40,
        gravity=GRAVITY,
    )
    assert _energy(sheet, lossy)[-1] < total[0] - 0.05 * moving


def _kinetic(sheet: Sheet, made: Flight) -> FloatArray:
    return (sheet.mass[:, None] * made.velocities**2).sum(axis=(1, 2)) / 2


def _energy(sheet: Sheet, made: Flight) -> FloatArray:
    """Kinetic, of height, and of the membrane as Saint Venant and Kirchhoff have it [J]; hinges
    hold too little."""
    corners = made.positions[:, sheet.mesh.faces]
    rest = sheet.mesh.rest[sheet.mesh.faces]
    flat = np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=-1)
    sides = np.stack(
        [corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]], axis=-1
    )
    gradient = sides @ np.linalg.inv(flat)
    strain = (gradient.swapaxes(2, 3) @ gradient - np.eye(2)) / 2
    shear = sheet.stretching / (2 * (1 + sheet.poisson))
    spread = sheet.stretching * sheet.poisson / (1 - sheet.poisson**2)
    density = (
        shear * (strain**2).sum(axis=(2, 3)) + spread / 2 * np.trace(strain, axis1=2, axis2=3) ** 2
    )
    height = GRAVITY * (sheet.mass * made.positions[:, :, 2]).sum(axis=1)
    return _kinetic(sheet, made) + height + (sheet.mesh.areas * density).sum(axis=1)
