"""Flags of the table, simulated: what is compared with a published number is read off the cloth and
its attachments.

Drag is the mean force on the attachments along the wind, which by the balance of momentum is all
that the air gives. Waves are read off the middle line of the cloth, at points fixed in the cloth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from sim.cloth.contact import Contact
from sim.cloth.material import Material, named_material
from sim.cloth.scene import Scene, assemble, flag
from sim.effects import EFFECTS, apply
from sim.integrate import Symplectic
from tests.studies.validation.flags_runs import one_core
from tests.studies.validation.real_flags.waves import waves

LENGTH, HEIGHT = 1.5, 1.0
AIR = 1.2
"""Density in coefficients and in the codes' formulas [kg/m³]."""
_NOISE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Flag:
    """A flag in a wind: 1.5 × 1.0 m of Camel Ponte Roma, two hoist corners held, of some area
    weight.

    Attributes:
        area_weight: [kg/m²].
        speed: of the wind [m/s].
    """

    area_weight: float
    speed: float


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """How a flag is simulated.

    Attributes:
        columns: cells along the length, so many that those over the height are even: there is a
            middle line.
        safety: share of the stability limit that a step takes.
        contact: whether layers keep apart.
        starts: how many runs, which differ by 1 mm of noise in the start.
        settle, kept: seconds left out, and read.
        rate: looks a second [Hz].
        seed: of the noise.
    """

    columns: int = 18
    safety: float = 0.7
    contact: bool = True
    starts: int = 4
    settle: float = 3.0
    kept: float = 6.0
    rate: float = 50.0
    seed: int = 1


READINGS = ("drag", "droop", "frequency", "wavelength", "speed", "amplitude")
"""C_D = F / (½ ρ U² L H); the angle of the middle of the free edge below that of the hoist [rad]; f L / U; λ / L;
c / U; r.m.s. of that middle across the wind over L. NaN where a run diverged or shows no travelling wave."""


def material(area_weight: float) -> Material:
    """Camel Ponte Roma with its declared damping, of another area weight [kg/m²]."""
    return replace(named_material("camel-ponte-roma"), area_weight=area_weight)


def scenes_of(one: Flag, numerics: Numerics) -> list[Scene]:
    """Its starts."""
    scene = flag(
        material=material(one.area_weight),
        wind_speed=one.speed,
        width=LENGTH,
        height=HEIGHT,
        columns=numerics.columns,
    )
    if numerics.contact:
        scene = replace(scene, contact=Contact())
    generator = stream(numerics.seed, "real-flags", f"{one.area_weight:g}-{one.speed:g}")
    noise = generator.normal(0.0, _NOISE, (numerics.starts, *scene.position.shape))
    noise[:, list(scene.handles.vertices)] = 0.0
    return [replace(scene, position=scene.position + part) for part in noise]


def simulated(
    flags: Sequence[Flag],
    *,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    numerics: Numerics | None = None,
) -> FloatArray:
    """(flag, start, reading) of flags with effects, name → parameters, the same for all."""
    how = numerics or Numerics()
    scenes = [scene for one in flags for scene in scenes_of(one, how)]
    acting = [EFFECTS[name](**values) for name, values in (effects or {}).items()]
    system, state = apply(acting, *assemble(scenes))
    rest = system.cloth.mesh.rest
    middle = np.flatnonzero(np.abs(rest[:, 1] - HEIGHT / 2) < 1e-6)
    middle = middle[np.argsort(rest[middle, 0])]
    integrator = Symplectic(safety=how.safety)
    line, pull = [], []
    with one_core():
        for look in range(round((how.settle + how.kept) * how.rate)):
            state = integrator.advance(system, state, 1 / how.rate)
            if look >= how.settle * how.rate:
                line.append(state.position[middle].numpy())
                stretch = state.position[system.held] - system.targets(state.time)
                pull.append((system.handles.stiffness * stretch).sum(0).numpy())
    healthy = state.healthy().numpy()
    course, force = np.stack(line).astype(np.float64), np.stack(pull).astype(np.float64)
    along = rest[middle, 0] / LENGTH
    rows = [
        read(course[..., i], force[..., i], along, flags[i // how.starts], how.rate)
        if healthy[i]
        else (np.nan,) * len(READINGS)
        for i in range(len(scenes))
    ]
    return np.array(rows).reshape(len(flags), how.starts, len(READINGS))


def read(
    course: FloatArray, force: FloatArray, along: FloatArray, one: Flag, rate: float
) -> tuple[float, ...]:
    """The readings of one run.

    Args:
        course: (look, point, 3) of the middle line from the hoist [m].
        force: (look, 3) of the cloth on its attachments [N].
        along: (point,) from the hoist over the length.
        one: the flag.
        rate: looks a second [Hz].
    """
    found = waves(course[:, :, 1], along, rate)
    frequency = found.frequency * LENGTH / one.speed
    chord = (course[:, -1] - course[:, 0]).mean(0)
    return (
        float(force[:, 0].mean() / (AIR / 2 * one.speed**2 * LENGTH * HEIGHT)),
        float(np.arctan2(-chord[2], np.hypot(chord[0], chord[1]))),
        frequency,
        found.length,
        frequency * found.length,
        float(course[:, -1, 1].std() / LENGTH),
    )
