"""Cloths simulated by MuJoCo: what is given, in SI units, and what comes back.

See `worker` for the model and for what it cannot do.
"""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from sim.cloth.mesh import Mesh
from tests.studies.validation.environments import UnusableError

_WORKER = Path(__file__).with_name("worker.py")


class Integrator(StrEnum):
    """MuJoCo's integrators that take a flex."""

    EULER = "Euler"
    """Semi-implicit: explicit for the flex, without damping of its own."""
    DISCRETE = "discrete"
    """Implicit for stiffness and damping of the flex; damps as backward Euler does."""


@dataclass(frozen=True, kw_only=True)
class Air:
    """The wind's force, for each m² of cloth at rest; 0 for what does not act. See `worker`.

    Attributes:
        pressure: p |w_n| w_n along the normal [kg/m³].
        lift: l w_n (|w| n − w_n w/|w|), across the relative wind [kg/m³].
        linear: c w_t [kg/(m² s)].
        quadratic: q |w_t| w_t [kg/m³].
        side: m |w| (vertical × w) [kg/m³].
        lag: s, the share of the pressure that lags as Wagner's function has it.
        carried: c of the mass of air c/((k/2)^(3/2) + (4/(π H))^(3/2))^(2/3) [kg/m³]; on a grid, by
            Euler.
    """

    pressure: float = 1.0
    lift: float = 0.0
    linear: float = 0.0
    quadratic: float = 0.0
    side: float = 0.0
    lag: float = 0.0
    carried: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Sheet:
    """A cloth of MuJoCo's: isotropic and of constant stiffness.

    Attributes:
        mesh: at rest.
        held: vertices that are held rigidly.
        area_weight: mass for each area [kg/m²].
        stretching: Y = E t, Young's modulus times thickness [N/m].
        poisson: Poisson's ratio.
        bending: D = E t³/(12 (1 − ν²)), flexural rigidity [N·m].
        damping: d [s]; stiffness-proportional.
        added: (vertex,) mass beside that of the sheet [kg]; None for none.
    """

    mesh: Mesh
    held: tuple[int, ...]
    area_weight: float
    stretching: float
    poisson: float = 0.0
    bending: float
    damping: float = 0.0
    added: FloatArray | None = None

    @property
    def thickness(self) -> float:
        """t of a homogeneous plate with this Y and D [m]."""
        return math.sqrt(12 * (1 - self.poisson**2) * self.bending / self.stretching)

    @property
    def mass(self) -> FloatArray:
        """(vertex,) a third of each face's at its corners, and what is added [kg]."""
        own = self.area_weight * self.mesh.vertex_areas
        return own if self.added is None else own + self.added


@dataclass(frozen=True, kw_only=True)
class Method:
    """How it is simulated.

    Attributes:
        integrator: of MuJoCo.
        step: [s]; the period of the frames is a whole number of them.
    """

    integrator: Integrator = Integrator.EULER
    step: float = 0.5e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight:
    """What came back.

    Attributes:
        positions, velocities: (frame, vertex, 3) [m], [m/s].
    """

    positions: FloatArray
    velocities: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Wind:
    """A uniform wind, linear between its samples, and constant beyond.

    Attributes:
        times: (n,) since the first frame that is kept [s].
        velocity: (n, 3) where the air goes to [m/s].
    """

    times: FloatArray = field(default_factory=lambda: np.zeros(1))
    velocity: FloatArray = field(default_factory=lambda: np.zeros((1, 3)))


def fly(
    python: Path,
    sheet: Sheet,
    *,
    start: FloatArray,
    reference: FloatArray | None = None,
    air: Air,
    wind: Wind,
    method: Method,
    rate: float,
    frames: int,
    settle: int = 0,
    gravity: float = 9.81,
) -> Flight:
    """Simulate a sheet that starts at rest.

    Args:
        python: of MuJoCo's environment.
        start: (vertex, 3) where it starts [m].
        reference: (vertex, 3) where it is without strain and flat [m]; None for where it starts.
        rate: of the frames [Hz].
        frames: that are kept.
        settle: frames before them that are not.
        gravity: along −z [m/s²].

    Raises:
        UnusableError: the worker failed, or its cloth became unstable.
    """
    settings: dict[str, Any] = {
        "step": method.step,
        "integrator": method.integrator.value,
        "gravity": gravity,
        "poisson": sheet.poisson,
        "young": sheet.stretching / sheet.thickness,
        "thickness": sheet.thickness,
        "damping": sheet.damping,
        "period": 1 / rate,
        "settle": settle,
        "frames": frames,
        "air": asdict(air),
    }
    with TemporaryDirectory(prefix="flagdata-mujoco-") as folder:
        job, made = Path(folder, "job.npz"), Path(folder, "made.npz")
        np.savez(
            job,
            start=start,
            reference=start if reference is None else reference,
            faces=sheet.mesh.faces,
            held=np.array(sheet.held, dtype=np.int64),
            areas=sheet.mesh.areas,
            mass=sheet.mass,
            rest=sheet.mesh.rest,
            vertex_areas=sheet.mesh.vertex_areas,
            wind_times=wind.times,
            wind=wind.velocity,
            settings=json.dumps(settings),
        )
        _run((str(python), "-I", str(_WORKER), str(job), str(made)))
        with np.load(made) as content:
            return Flight(positions=content["positions"], velocities=content["velocities"])


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise UnusableError(
            said[-1] if said else "the worker printed nothing",
            where="MuJoCo",
            fix="take smaller steps",
        )
