"""The verification problems with closed forms, at any resolution: what is simulated, and what it
should be.

The tests run them at small size; `make validate` draws the full curves.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.integrate import quad, solve_bvp
from scipy.optimize import brentq
from scipy.signal import welch
from scipy.special import j0, jn_zeros

from flagdata.core.arrays import FloatArray
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import Handles
from sim.cloth.material import isotropic, named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.integrate import Symplectic, advance, stable_step
from tests.verification.motion import edge_motion
from tests.verification.systems import build, settle

G = 9.81
FRAME = 0.04
SWING_SLOWING = 0.2 * G / (4 * 2000.0)
"""Half the static stretch ρ g L/(2 K) of the sheet of `swing`, over its length: about what its
frequencies lose by it: the inextensible theory holds no closer."""
OCTAVES = ((0.5, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0))
"""Bands of the tip's spectrum [Hz]."""
KICKED_MESH = grid(width=0.5, height=0.4, columns=5, rows=4)


def kicked(state: State) -> State:
    """A velocity that stretches, folds and turns a sheet of `KICKED_MESH`."""
    u, v = KICKED_MESH.rest.T
    field = np.stack(
        [1.5 * np.sin(7 * u + 3 * v), 0.4 * np.cos(9 * v), 0.3 * np.sin(5 * u)], axis=1
    )
    velocity = torch.tensor(field).unsqueeze(-1).expand_as(state.position).contiguous()
    return State(position=state.position, velocity=velocity, time=state.time)


def energy_drift(*, duration: float, share: float) -> FloatArray:
    """Relative error of the total energy of a kicked, undamped sheet, every 10 ms.

    Args:
        duration: [s].
        share: step over the stability limit.
    """
    plain = isotropic(name="plain", area_weight=0.2, stretching=60.0, shear=60.0, bending=2e-3)
    system, state = build(KICKED_MESH, [plain])
    state = kicked(state)
    total = float(sum(system.energies(state).values()))
    block = 0.01
    steps = math.ceil(block / (share * stable_step(system)))
    errors = []
    for _ in range(round(duration / block)):
        state = advance(system, state, block, steps=steps)
        errors.append(float(sum(system.energies(state).values())) / total - 1)
    return np.array(errors)


def hung_strip(rows: int) -> tuple[float, float]:
    """Length of a strip hung by its upper edge, simulated and exact [m].

    Without Poisson effect the strip is a bar in tension: K λ (λ² − 1)/2 = ρ g (L − s) at distance s
    below the support, K the membrane stiffness, and the lower end at ∫ λ ds.
    """
    length, stiffness, area_weight = 1.0, 30.0, 0.3

    def stretch(s: float) -> float:
        pull = area_weight * G * (length - s) / stiffness
        return brentq(lambda x: x * (x * x - 1) / 2 - pull, 0.5, 3.0, xtol=1e-15)

    expected = quad(stretch, 0, length, epsabs=1e-13)[0]
    mesh = grid(width=0.2, height=length, columns=2, rows=rows)
    top = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 1] > length - 1e-9))
    material = isotropic(
        name="bar", area_weight=area_weight, stretching=stiffness, shear=30.0, bending=0.0
    )
    held = Handles(vertices=top, stiffness=math.inf)
    system, state = build(mesh, [material], handles=held, gravity=(0.0, 0.0, -G))
    final = settle(system, state)
    bottom = np.flatnonzero(mesh.rest[:, 1] < 1e-9)
    # The lumped masses of a row differ, so that it is not quite level: the row's mean by mass.
    z = np.average(final.position[bottom, 2, 0].numpy(), weights=mesh.vertex_areas[bottom])
    return length - float(z), expected


def elastica_tip(rigidity: float, weight: float, length: float) -> tuple[float, float]:
    """Tip of an inextensible strip clamped level: B θ'' = q (L − s) cos θ, θ(0) = 0, θ'(L) = 0, q =
    ρ g (θ downwards positive, so θ'' = −q (L − s) cos θ / B). Returns how far out and how far down
    the tip is [m]."""

    def slope(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack(
            [y[1], -weight * (length - s) * np.cos(y[0]) / rigidity, np.cos(y[0]), np.sin(y[0])]
        )

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, length, 200)
    guess = np.stack([1.2 * s / length, 0 * s, s, 0.5 * s])
    solution = solve_bvp(slope, ends, s, guess, tol=1e-9, max_nodes=100_000)
    assert solution.success
    return float(solution.y[2, -1]), float(solution.y[3, -1])


def drooped_tips(
    tables: Sequence[float], *, columns: int, length: float = 0.15, area_weight: float = 0.2
) -> FloatArray:
    """Tips of strips clamped level in gravity, (table, 2): out and down [m].

    The flexural rigidity B of the grid with alternating diagonals, by hand: let the lines along the strip turn by a at
    vertices where eight triangles meet and by b where four do, a + b = 2 κ h. Edges across the strip fold by a, with
    S = ½; the diagonals by (b − a)/√2, with S = 1. The energy k S θ²/4 of a cell, k (a² + (b − a)²)/8, is least at
    a = 0.8 κ h, where it is 0.8 k κ² h²/8 = B κ² h²/2: B = k/5. The fixed first cell clamps the strip at its middle:
    half a cell counts as free. The turns alternate, so that the one at the clamp, where curvature is largest, is off by
    a fifth: an error of first order in the cell (observed 1.2).

    Args:
        tables: bending stiffness k = 5 B of each strip [N·m].
        columns: cells along the strip.
        length: free length [m].
        area_weight: [kg/m²].
    """
    cell = length / (columns - 0.5)
    mesh = grid(width=cell * columns, height=cell, columns=columns, rows=1)
    materials = [
        isotropic(
            name=f"k{k}",
            area_weight=area_weight,
            stretching=400.0,
            shear=400.0,
            bending=k,
            damping=2e-5,
        )
        for k in tables
    ]
    clamp = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 0] < 1.5 * cell))
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    held = Handles(vertices=clamp, stiffness=math.inf)
    system, state = build(mesh, materials, position=flat, handles=held, gravity=(0.0, 0.0, -G))
    final = settle(
        system, state, rest=1e-4
    )  # accelerations below g/500: tips to 1e-3 of their deflection
    tip = np.flatnonzero(mesh.rest[:, 0] > cell * (columns - 0.5))
    x = final.position[tip].mean(0).numpy()
    return np.stack([x[0] - cell / 2, -x[2]], axis=1)


def swing(mode: int, *, rows: int) -> tuple[float, float]:
    """Angular frequency of a hanging sheet's pendulum mode, simulated and exact [rad/s].

    A chain or sheet without bending stiffness: ω_n = (j_{0,n}/2) √(g/L), shape J0(j_{0,n} √(z/L)),
    z from the free end (Bernoulli 1733; Lamb, Higher Mechanics). The chain of rows with lumped
    masses is of second order in 1/rows.
    """
    length = 1.0
    mesh = grid(width=3 * length / rows, height=length, columns=1, rows=rows)
    top = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 1] > length - 1e-9))
    material = isotropic(name="limp", area_weight=0.2, stretching=2000.0, shear=2000.0, bending=0.0)
    held = Handles(vertices=top, stiffness=math.inf)
    system, state = build(mesh, [material], handles=held, gravity=(0.0, 0.0, -G))
    root = float(jn_zeros(0, mode)[-1])
    shape = torch.tensor(j0(root * np.sqrt(mesh.rest[:, 1] / length)))
    # Hung at its static stretch ρ g (L − s)/K, so that it does not bounce: displacement ρ g (L s −
    # s²/2)/K downwards.
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
    return math.pi * (len(times) - 1) / (times[-1] - times[0]), omega


def terminal_velocity() -> float:
    """Of the sheet of `fall`: √(ρ_s g/ρ) [m/s]."""
    return math.sqrt(0.15 * G / 1.2)


def fall(duration: float, *, steps: int, looks: int = 1) -> FloatArray:
    """A level sheet that falls from rest in still air, (look, 5): time [s], speed and depth
    simulated, and exact [SI].

    m dv/dt = m g − ρ A v²: v = v_t tanh(g t/v_t), v_t = √(ρ_s g/ρ); the fall is (v_t²/g) ln cosh(g
    t/v_t). The air sees
    the velocity half a step back: first order in the step.

    Args:
        duration: [s].
        steps: in all.
        looks: how often to look; a divisor of `steps`.
    """
    area_weight, air = 0.15, 1.2
    mesh = grid(width=0.3, height=0.3, columns=3, rows=3)
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    material = isotropic(
        name="sheet", area_weight=area_weight, stretching=50.0, shear=50.0, bending=1e-4
    )
    system, state = build(
        mesh, [material], position=flat, gravity=(0.0, 0.0, -G), air=QuadraticNormal(density=air)
    )
    terminal, mass = terminal_velocity(), system.cloth.mass[:, 0]
    rows = []
    for _ in range(looks):
        state = advance(system, state, duration / looks, steps=steps // looks)
        share = G * state.time / terminal
        speed = -float((mass * state.velocity[:, 2, 0]).sum() / mass.sum())
        depth = -float((mass * state.position[:, 2, 0]).sum() / mass.sum())
        exact = terminal * math.tanh(share), terminal**2 / G * math.log(math.cosh(share))
        rows.append((state.time, speed, depth, *exact))
    return np.array(rows)


def step_errors(counts: Sequence[int], *, finest: int, frames: int = 4) -> FloatArray:
    """Mean distance of a flag's vertices from the finest run [m] while its motion is predictable.

    Args:
        counts: steps a frame.
        finest: steps a frame of the run they are compared with.
        frames: of 40 ms, from rest at 4 m/s.
    """
    system, start = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4, columns=12)],
        dtype=torch.float64,
    )

    def after(steps: int) -> torch.Tensor:
        state = start
        for _ in range(frames):
            state = advance(system, state, FRAME, steps=steps)
        return state.position

    exact = after(finest)
    return np.array([float((after(steps) - exact).norm(dim=1).mean()) for steps in counts])


def mesh_differences(counts: Sequence[int], *, frames: int = 4) -> FloatArray:
    """Mean distance between a flag's vertices on each mesh and the next [m], (counts − 1,), before
    chaos sets in.

    Args:
        counts: columns of the meshes, each a multiple of the first; compared at the first's
            vertices.
        frames: of 40 ms, from rest at 4 m/s.
    """
    places = []
    for columns in counts:
        system, state = assemble(
            [flag(material=named_material("camel-ponte-roma"), wind_speed=4, columns=columns)],
            dtype=torch.float64,
        )
        state = Symplectic().advance(system, state, frames * FRAME)
        every = columns // counts[0]
        rows = round(columns / 1.5) + 1
        grid_ = state.position[..., 0].numpy().reshape(columns + 1, rows, 3)
        places.append(grid_[::every, ::every])
    return np.array([np.linalg.norm(b - a, axis=-1).mean() for a, b in itertools.pairwise(places)])


def edge_statistics(
    columns: int, *, seed: int, wind: float, members: int, share: float
) -> FloatArray:
    """(member, 8) of a settled flag: its free edge's height [m], distance downwind [m], speed [m/s]
    and frequency [Hz], and the power of its upper corner's motion across the wind in each of
    `OCTAVES` [m²]."""
    scene = flag(material=named_material("camel-ponte-roma"), wind_speed=wind, columns=columns)
    edge = np.flatnonzero(scene.mesh.rest[:, 0] > 1.5 - 1e-6)
    noise = np.random.default_rng(seed).normal(0, 1e-3, (members, *scene.position.shape))
    system, state = assemble([replace(scene, position=scene.position + n) for n in noise])
    steps = math.ceil(Symplectic().steps(system, FRAME) / share)
    track = []
    for frame in range(250):
        state = advance(system, state, FRAME, steps=steps)
        if frame >= 75:
            track.append(state.position[edge].numpy())
    assert bool(state.healthy().all())
    runs = [edge_motion(np.stack(track)[..., b], rate=1 / FRAME) for b in range(members)]
    motion = np.array(
        [[run.position[2] - 0.5, run.position[0], run.speed, run.frequency] for run in runs]
    )
    return np.concatenate([motion, _tip_power(np.stack(track)[:, -1, 1])], axis=1)


def _tip_power(across: NDArray[np.floating]) -> FloatArray:
    """(member, octave) mean square of a displacement (frame, member) in each of `OCTAVES`, from
    pieces of 4 s."""
    frequency, area_weight = welch(
        across.astype(np.float64), fs=1 / FRAME, nperseg=100, detrend="linear", axis=0
    )
    inside = [(low <= frequency) & (frequency < high) for low, high in OCTAVES]
    return np.stack([area_weight[band].sum(0) * frequency[1] for band in inside], axis=1)
