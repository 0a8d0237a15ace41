"""The ensembles behind the page on flags: against the wind, and against the damping.

The flag is the reference runs': 1.5 × 1.0 m of Camel Ponte Roma (0.284 kg/m²), 30 × 20 cells, two
hoist corners held, from rest across the wind. Replicates differ by 1 mm of noise in the start.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.rng import stream
from sim.cloth.contact import Contact
from sim.cloth.material import named_material
from sim.cloth.scene import Scene, assemble, flag
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate import BackwardEuler, Integrator, Symplectic
from sim.run import principal_strains
from tests.verification.motion import edge_motion

RATE = 50.0
"""Looks a second [Hz]: twice the cameras', so that what a picture at 25 Hz would fold back shows in
the spectra."""
SETTLED = 4.0
"""Time that is left out of the statistics [s]; flags stream after one to two."""
WINDS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
DAMPINGS = (0.0, 0.05e-3, 0.1e-3, 0.25e-3, 0.5e-3, 1e-3)
STEPS = (1e-3, 2.5e-3, 5e-3, 10e-3)
ENERGY_EVERY = 4
REPLICATES = 8
NOISE = 1e-3
CAMEL = named_material("camel-ponte-roma")


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """Runs of flags, looked at `RATE` times a second, and their energies at every `ENERGY_EVERY`th
    look.

    Attributes:
        values: (group,) what differs between groups (wind [m/s] or damping [s]).
        edge: (look, edge vertex, 3, group, replicate) positions of the free edge, from its lower
            end [m].
        first: (look, vertex, 3, group) all positions of each group's first replicate [m].
        energies: name → (look, group, replicate) [J], gravity's relative to the start; contact's is
            left out.
        compression: (group, replicate) root mean square compression of the faces, over the settled
            time while healthy; NaN where there is none.
        lasted: (group, replicate) how long each run was healthy [s]; those that diverged have NaN
            statistics.
    """

    values: FloatArray
    edge: NDArray[np.floating]
    first: NDArray[np.floating]
    energies: dict[str, NDArray[np.floating]]
    compression: NDArray[np.floating]
    lasted: NDArray[np.floating]

    @property
    def settled(self) -> NDArray[np.floating]:
        """`edge` without the start."""
        return self.edge[round(SETTLED * RATE) :]

    @property
    def statistics(self) -> FloatArray:
        """(group, replicate, 5) of the settled free edge: mean x, y, z [m], speed [m/s], frequency
        [Hz].

        From every other look, so that velocities are differences over 40 ms as in the reference's
        frames.
        """
        settled = self.settled[::2]
        groups, replicates = settled.shape[3:]
        rows = [
            [edge_motion(settled[..., g, r], rate=RATE / 2) for r in range(replicates)]
            for g in range(groups)
        ]
        values = np.array([[(*m.position, m.speed, m.frequency) for m in row] for row in rows])
        return np.where(self.diverged[..., None], np.nan, values)

    @property
    def diverged(self) -> BoolArray:
        """(group, replicate)."""
        return self.lasted < (len(self.edge) - 1) / RATE - 1e-9


def against_wind(seed: int) -> Ensemble:
    """Flags at every wind, with self-contact and friction, d = 0.25 ms."""
    scenes = [replace(flag(material=CAMEL, wind_speed=wind), contact=Contact()) for wind in WINDS]
    return _run(
        WINDS,
        [(pair, Symplectic()) for pair in _pairs(scenes)],
        seed=seed,
        path="wind",
        seconds=13.0,
    )


def against_wind_implicit(seed: int, *, step: float = 5e-3) -> Ensemble:
    """The same by backward Euler at the paper's step [s] without declared damping, contact off."""
    scenes = [flag(material=replace(CAMEL, damping=0.0), wind_speed=wind) for wind in WINDS]
    method = BackwardEuler(step=step, tolerance=1e-4)
    return _run(
        WINDS,
        [(pair, method) for pair in _pairs(scenes)],
        seed=seed,
        path="wind-implicit",
        seconds=12.0,
    )


def against_damping(seed: int, *, wind: float = 4.0) -> Ensemble:
    """Flags of every damping in one wind [m/s], contact off."""
    scenes = [
        flag(material=replace(CAMEL, damping=damping), wind_speed=wind) for damping in DAMPINGS
    ]
    return _run(
        DAMPINGS,
        [(pair, Symplectic()) for pair in _pairs(scenes)],
        seed=seed,
        path="damping",
        seconds=10.0,
    )


def against_step(seed: int, *, wind: float = 4.0) -> Ensemble:
    """The same flag without declared damping, by backward Euler at several steps."""
    scene = flag(material=replace(CAMEL, damping=0.0), wind_speed=wind)
    batches = [([scene], BackwardEuler(step=step, tolerance=1e-4)) for step in STEPS]
    return _run(STEPS, batches, seed=seed, path="implicit", seconds=10.0)


def _pairs(scenes: list[Scene]) -> list[list[Scene]]:
    """Two groups fill the kernel's lanes; neighbours in stiffness share a step."""
    return [scenes[i : i + 2] for i in range(0, len(scenes), 2)]


def _run(
    values: tuple[float, ...],
    batches: list[tuple[list[Scene], Integrator]],
    *,
    seed: int,
    path: str,
    seconds: float,
) -> Ensemble:
    """Every scene with its replicates, batch by batch."""
    parts = []
    for index, (scenes, method) in enumerate(batches):
        generator = stream(seed, "validate-flags", path, str(index))
        members = [member for scene in scenes for member in _noisy(scene, generator)]
        system, state = assemble(members)
        parts.append(_watch(system, state, method, groups=len(scenes), looks=round(seconds * RATE)))
    energies = {
        name: np.concatenate([part.energies[name] for part in parts], axis=1)
        for name in parts[0].energies
    }
    energies["gravity"] = energies["gravity"] - energies["gravity"][:1]
    return Ensemble(
        values=np.array(values),
        edge=np.concatenate([part.edge for part in parts], axis=3),
        first=np.concatenate([part.first for part in parts], axis=3),
        energies=energies,
        compression=np.concatenate([part.compression for part in parts]),
        lasted=np.concatenate([part.lasted for part in parts]),
    )


def _noisy(scene: Scene, generator: np.random.Generator) -> list[Scene]:
    noise = generator.normal(0.0, NOISE, (REPLICATES, *scene.position.shape))
    noise[:, list(scene.handles.vertices)] = 0.0
    return [replace(scene, position=scene.position + one) for one in noise]


def _watch(
    system: System, state: State, method: Integrator, *, groups: int, looks: int
) -> Ensemble:
    """Run one batch, whose members come group by group."""
    rest = system.cloth.mesh.rest
    free_edge = np.flatnonzero(rest[:, 0] > rest[:, 0].max() - 1e-6)
    touchless = replace(system, contact=None)
    edge, first, energies, squares = [], [], [], []
    lasted = np.zeros(state.position.shape[-1])
    for look in range(looks + 1):
        if look:
            state = method.advance(system, state, 1 / RATE)
        edge.append(state.position[free_edge].numpy())
        first.append(state.position[..., ::REPLICATES].numpy())
        if look % ENERGY_EVERY == 0:
            energies.append(
                {name: value.double().numpy() for name, value in touchless.energies(state).items()}
            )
            if look > SETTLED * RATE:
                strains = principal_strains(system.cloth, state.position)[:, 0]
                square = (strains.clamp(max=0) ** 2).mean(0)
                squares.append(torch.where(state.healthy(), square, torch.nan).numpy())
        lasted = np.where(state.healthy().numpy(), look / RATE, lasted)
    known = np.isfinite(squares)
    compression = np.sqrt(
        np.where(known, squares, 0).sum(0) / np.where(known.any(0), known.sum(0), np.nan)
    )

    def grouped(values: NDArray[np.floating]) -> NDArray[np.floating]:
        return values.reshape(*values.shape[:-1], groups, REPLICATES)

    return Ensemble(
        values=np.zeros(groups),
        edge=grouped(np.stack(edge)),
        first=np.stack(first),
        energies={name: grouped(np.stack([e[name] for e in energies])) for name in energies[0]},
        compression=grouped(compression),
        lasted=grouped(lasted),
    )


@contextmanager
def one_core() -> Iterator[None]:
    """One thread and no gradients."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.no_grad():
            yield
    finally:
        torch.set_num_threads(threads)
