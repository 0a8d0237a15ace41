"""Flags of drawn cloths simulated in the minutes of a log, each in its own turbulence, and what
places see of them.

A batch is simulated together and read at once: its meshes are not kept, only its observables,
window by window. The mesh is coarse, since what is asked for are means over windows; what that
costs is measured against finer ones and is part of an answer's interval (`measure.cloth.numerics`).
Null experiments have meshes and steps of other kinds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from measure.cloth.blown_wind import WIND_RATE, Log, blown
from measure.cloth.flag_prior import TABLES
from measure.forecasting.regressors import EffectColumn
from measure.nulls.null_meshes import remesh
from measure.observables import OBSERVABLES, Observable, View, seen_from
from measure.observables.observable import WINDOW
from measure.observables.tracked_cloth import edges_of
from sim.cloth import handles as held
from sim.cloth.handles import Handles
from sim.cloth.material import Material, named_material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble, roughen_start
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import apply
from sim.integrate import Integrator
from sim.integrate.implicit import BackwardEuler
from sim.integrate.symplectic import Symplectic
from sim.run import simulation_loop
from sim.wind.sampled import Beyond, Even, SampledWind

FINER = (0.85, 1.2)
"""Vertices along a side over the fit's, by its mean area a vertex: 11 to 16 columns. Up to 1.75 on
trajectories; here a minute of film costs as much as 30 of their segments, and what finer meshes do
is measured and part of the scatter (`measure.cloth.numerics`)."""
STEPS = (2e-3, 3e-3, 4e-3)
"""Of backward Euler [s]."""
LITTLE = 1e-3
"""s of damping below which cloths are simulated by leapfrog, whose steps may be the longer the less
they damp."""


@dataclass(frozen=True, kw_only=True)
class Discretisation:
    """One kind of numerics.

    Attributes:
        finer: vertices along a side over the fit's.
        diagonals: which way a grid's faces are cut: 0 or 1 of `Diagonals`.
        uneven: seed of an irregular mesh; None for a grid.
        step: of backward Euler [s]; None for leapfrog.
    """

    finer: float
    diagonals: int
    uneven: int | None
    step: float | None

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, explicit: float) -> Discretisation:
        """Draws one at random: half of the meshes are irregular, as other codes' are.

        Args:
            explicit: share of leapfrog.
        """
        low, high = FINER
        return cls(
            finer=float(rng.uniform(low, high)),
            diagonals=int(rng.integers(2)),
            uneven=int(rng.integers(2**31)) if rng.random() < 0.5 else None,
            step=None if rng.random() < explicit else float(STEPS[rng.integers(len(STEPS))]),
        )

    def mesh(self, fit: Mesh) -> Mesh:
        """Makes this kind's mesh of the cloth of the fit's one."""
        uneven = None if self.uneven is None else stream(self.uneven, "discretisation", "mesh")
        return remesh(fit, finer=self.finer, diagonals=self.diagonals, uneven=uneven)

    def content(self) -> dict[str, float | int | None]:
        """Returns JSON values."""
        return {
            "finer": self.finer,
            "diagonals": self.diagonals,
            "uneven": self.uneven,
            "step": self.step,
        }


COLUMNS = 12
RATE = 12.5
"""Frames of a simulation [Hz]: a flag of a metre flutters at 1 to 3 Hz, and to observe flags costs
a third of what they do to simulate. Higher shows faster motion and costs drawing in proportion;
lower misses the second harmonic of the flutter."""
SETTLE = 4.0
"""s before the film's first frame that are simulated and not looked at: two swings of a flag of 1.5
m. Shorter leaves the start in the film; longer costs time in proportion."""
BATCH = 16
"""Flags that are simulated together: what a vector register holds in single precision."""
VERSION = 6
"""Raised where the same batch gives other numbers."""
OBSERVED = (
    "droop",
    "extension",
    "middle-speed",
    "frequency",
    "bandwidth",
    "amplitude-up",
    "amplitude-across",
    "area",
)
"""Observables that are asked for: a coarse mesh shows no travelling waves, and few windows show
them."""
_STEPS = (1e-3, 2e-3, 4e-3)
"""Steps of backward Euler [s], which damps as much by itself; the least damping of a batch allows
the step. Cloths that all damp less than the shortest are simulated by leapfrog, whose steps may be
the longer the less they damp."""
_TOLERANCE = 1e-2
"""Relative residual of a step's solve; a tenth of it costs a third more and shows the same
(decision 042)."""
_ROUGH = 1e-3
"""Standard deviation of the free vertices' start [m]."""
_AHEAD = 0.3
"""rad from downwind, in which a flag starts."""


@dataclass(frozen=True, kw_only=True)
class Flag:
    """The flag that was filmed, as it is stated.

    Attributes:
        length, height: of the flat cloth, along the wind and along the pole [m].
        attachment: "corners" or "hoist".
    """

    length: float
    height: float
    attachment: str = "corners"

    @property
    def words(self) -> str:
        """Its size, and how it is held."""
        held_at = "at both ends of its hoist" if self.attachment == "corners" else "along its hoist"
        return f"{self.length:g} m × {self.height:g} m, held {held_at}"

    def mesh(self, columns: int) -> Mesh:
        """Makes a regular mesh of it."""
        rows = max(2, round(columns * self.height / self.length))
        return grid(width=self.length, height=self.height, columns=columns, rows=rows)

    def handles(self, mesh: Mesh) -> Handles:
        """Returns how it is held."""
        vertices = (
            held.full_hoist(mesh.rest) if self.attachment == "hoist" else held.corners(mesh.rest)
        )
        return Handles(vertices=vertices)


@dataclass(frozen=True, kw_only=True, eq=False)
class FlagBatch:
    """Flags that are simulated together, and where they are looked at from.

    Attributes:
        flag: that was filmed.
        log: of the wind beside it.
        duration: of the film, a whole number of windows [s].
        values: name of a quantity → (flag,): area_weight, bending, damping, stretching, gain,
            scale, eddies, fabric, distance_constant; clock_error [s] where the log's clock is
            uncertain.
        places: azimuth, elevation [rad] and distance [m] of each place, (flag, place, 3).
        seeds: (flag,) of the start and the turbulence.
        columns: of the mesh.
        observables: names.
        effects: what acts beside the base model, each with its strengths beyond the null one,
            (flag,).
        until: the film's part that is simulated, in the wind of all of it [s]; None for all.
        discretisation: the mesh and the steps where they are others than the fit's.
    """

    flag: Flag
    log: Log
    duration: float
    values: Mapping[str, FloatArray]
    places: FloatArray
    seeds: tuple[int, ...]
    columns: int = COLUMNS
    observables: tuple[str, ...] = OBSERVED
    effects: tuple[tuple[EffectColumn, FloatArray], ...] = field(default_factory=tuple)
    until: float | None = None
    discretisation: Discretisation | None = None

    @property
    def windows(self) -> int:
        """Windows of the film that are simulated."""
        return math.floor(self._simulated_seconds / WINDOW + 1e-9)

    @property
    def _simulated_seconds(self) -> float:
        return self.duration if self.until is None else self.until

    def content(self) -> Mapping[str, object]:
        """Returns all that shapes what it gives, as JSON values."""
        log = self.log
        return {
            "version": VERSION,
            "flag": [self.flag.length, self.flag.height, self.flag.attachment],
            "log": [
                log.times.tolist(),
                log.speed.tolist(),
                None if log.turn is None else log.turn.tolist(),
            ],
            "averaging": log.averaging,
            "duration": self.duration,
            "values": {name: numbers.tolist() for name, numbers in sorted(self.values.items())},
            "places": self.places.tolist(),
            "seeds": list(self.seeds),
            "columns": self.columns,
            "observables": list(self.observables),
            **self._additions(),
        }

    def _additions(self) -> dict[str, object]:
        """Returns what differs from a calibration's simulations, whose hash is older."""
        content: dict[str, object] = {}
        if self.effects:
            content["effects"] = [
                [
                    effect.name,
                    dict(effect.shapes),
                    strengths.tolist(),
                    *([effect.revision] if effect.revision > 1 else []),
                ]
                for effect, strengths in self.effects
            ]
        if self.until is not None:
            content["until"] = self.until
        if self.discretisation is not None:
            content["discretisation"] = self.discretisation.content()
        return content

    @property
    def effort(self) -> int:
        """Simulated seconds of all its flags."""
        return round(len(self.seeds) * self._simulated_seconds)

    def arrays(self) -> Mapping[str, FloatArray]:
        """Simulates and observes it; see `read`."""
        return {"readings": self.read()}

    def read(self) -> FloatArray:
        """Simulates and observes (flag, place, window, observable), NaN where a window does not
        show one or a flag diverged."""
        numerics = self.discretisation
        mesh = (
            self.flag.mesh(self.columns)
            if numerics is None
            else numerics.mesh(self.flag.mesh(self.columns))
        )
        positions = self.positions(mesh)
        readings = np.full(
            (len(self.seeds), self.places.shape[1], self.windows, len(self.observables)), np.nan
        )
        for member, flag in enumerate(np.moveaxis(positions, -1, 0)):
            if np.isfinite(flag).all():
                scale = float(self.values["scale"][member])
                for number, (azimuth, elevation, distance) in enumerate(
                    self.places[member].tolist()
                ):
                    view = View(azimuth=azimuth, elevation=elevation, distance=distance)
                    readings[member, number] = windows(
                        flag * scale,
                        mesh=mesh,
                        flag=self.flag,
                        view=view,
                        rate=RATE,
                        observables=self.observables,
                    )
        return readings

    def positions(self, mesh: Mesh, *, rate: float = RATE) -> FloatArray:
        """Simulates (frame, vertex, 3, flag) [m] of the film's frames, `rate` a second [Hz]."""
        system, state, integrator = self._assemble_flags(mesh)
        simulated = simulation_loop.Batch(
            system=system,
            state=state,
            integrator=integrator,
            divergence=simulation_loop.Divergence.KEEP,
        )
        return simulated.positions(
            simulation_loop.after(SETTLE, self._simulated_seconds, rate), rate
        )

    def _assemble_flags(self, mesh: Mesh) -> tuple[System, State, Integrator]:
        """Flags in their winds at rest, and what simulates them."""
        step = self.step
        system, state = assemble(self._scenes(mesh, damped=step or 0.0))
        integrator = (
            Symplectic() if step is None else BackwardEuler(step=step, tolerance=_TOLERANCE)
        )
        system = replace(system, wind=self._wind(system))
        system, state = apply(
            [effect.at(torch.from_numpy(strengths)) for effect, strengths in self.effects],
            system,
            state,
        )
        return system, state, integrator

    def _scenes(self, mesh: Mesh, *, damped: float) -> list[Scene]:
        """Makes the scenes at rest; `damped` is the damping of the integrator itself [s]."""
        handles = self.flag.handles(mesh)
        scenes = []
        for member, seed in enumerate(self.seeds):
            along = mesh.rest[:, 0]
            flat = np.stack(
                [along * math.cos(_AHEAD), along * math.sin(_AHEAD), mesh.rest[:, 1]], axis=1
            )
            material = self._material(member, damped)
            start = roughen_start(flat, handles, stream(seed, "calibrate", "start"), _ROUGH)
            scenes.append(Scene(mesh=mesh, position=start, material=material, handles=handles))
        return scenes

    def _material(self, index: int, damped: float) -> Material:
        drawn = {name: float(values[index]) for name, values in self.values.items()}
        return cloth(
            drawn["area_weight"],
            drawn["bending"],
            max(drawn["damping"] - damped, 0.0),
            stretching=drawn["stretching"],
            fabric=TABLES[int(drawn["fabric"] * len(TABLES))],
        )

    def _wind(self, system: System) -> SampledWind:
        winds = []
        for member, seed in enumerate(self.seeds):
            drawn = {name: float(values[member]) for name, values in self.values.items()}
            velocity = blown(
                self.log.moved(drawn.get("clock_error", 0.0)),
                before=SETTLE,
                duration=self.duration,
                distance=drawn["distance_constant"],
                eddies=drawn["eddies"],
                seed=child_seed(seed, "calibrate", "wind"),
            )
            winds.append(velocity * drawn["gain"])
        samples = torch.as_tensor(np.stack(winds, axis=-1), dtype=system.cloth.dtype)
        times = Even(start=0.0, period=1 / WIND_RATE, count=len(samples))
        return SampledWind(times=times, samples=samples, beyond=Beyond.HOLD)

    @property
    def step(self) -> float | None:
        """Returns the step of backward Euler [s]; None where leapfrog simulates them."""
        if self.discretisation is not None:
            return self.discretisation.step
        damping = self.values["damping"]
        if damping.max() < min(_STEPS):
            return None
        return max((step for step in _STEPS if step <= damping.min()), default=min(_STEPS))


def cloth(
    area_weight: float, bending: float, damping: float, *, stretching: float, fabric: str
) -> Material:
    """Returns a cloth of an area weight [kg/m²], a mean bending coefficient [N·m] and a damping
    [s].

    Args:
        stretching: factor on the fabric's table.
        fabric: a material of the catalog.
    """
    base = named_material(fabric)
    return replace(
        base,
        area_weight=area_weight,
        damping=damping,
        stretching=base.stretching * stretching,
        bending=base.bending * (bending / mean_bending(base)),
    )


def mean_bending(material: Material) -> float:
    """Returns the geometric mean of the bending coefficients [N·m], which takes a coefficient of 0
    for a thousandth of the mean."""
    table = np.maximum(material.bending, 1e-3 * float(material.bending.mean()))
    return float(np.exp(np.log(table).mean()))


def windows(
    positions: NDArray[np.floating],
    *,
    mesh: Mesh,
    flag: Flag,
    view: View,
    rate: float,
    observables: Sequence[str],
) -> FloatArray:
    """Observes (window, observable) of a flag (frame, vertex, 3) [m] in the wind along +x, seen
    from a place.

    Args:
        rate: frames a second [Hz].
    """
    hoist, free = edges_of(mesh.rest)
    size = round(WINDOW * rate)
    definitions: list[Observable] = [OBSERVABLES[name] for name in observables]
    times = np.arange(size) / rate
    rows = []
    for first in range(0, len(positions) - size + 1, size):
        window = seen_from(
            view,
            positions[first : first + size],
            times=times,
            faces=mesh.faces,
            hoist=hoist,
            free=free,
            length=flag.length,
            height=flag.height,
        )
        rows.append([definition.of_cloth(window).value for definition in definitions])
    return np.array(rows)
