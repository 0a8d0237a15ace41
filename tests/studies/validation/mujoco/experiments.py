"""Experiments of a flag by MuJoCo: drawn from a seed, simulated, and written as a user would bring
them.

What is declared is one nominal cloth, level winds along +x and nothing else. What is simulated is
another cloth by
another method: area weight, stretching, bending and damping differ from the nominal ones, and an
undeclared effect may act.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.rng import stream
from sim.cloth import handles
from sim.cloth.mesh import Diagonals, grid
from sim.effects import AIR_DENSITY
from tests.studies.validation.mujoco.cloth import Air, Integrator, Method, Sheet, Wind, fly

WIDTH, HEIGHT = 1.5, 1.0  # m
COLUMNS, ROWS = 20, 14
SEEN = 2
"""Every so many-th vertex in both directions is a marker: 11 × 8 of 21 × 15."""
RATE, DURATION, SETTLE = 25.0, 8.4, 3.0  # Hz, s, s: four segments of 2 s of each recording
NOISE = 1e-3  # m
SPEEDS = (2.5, 7.5)  # m/s; one wind from each third
_STEPS = (2e-3, 4e-3)  # s, of implicit steps
_HEADING = 0.5  # rad: how far from downwind a flag starts

NOMINAL = Sheet(
    mesh=grid(width=WIDTH, height=HEIGHT, columns=COLUMNS, rows=ROWS),
    held=(),
    area_weight=0.284,
    stretching=120.0,
    poisson=0.2,
    bending=9e-6,
    damping=0.25e-3,
)
"""About Camel Ponte Roma, isotropic: its area weight, tension at small strain, and k/4 of its
bending table."""
SPREAD: Mapping[str, tuple[float, float]] = {
    "area_weight": (0.85, 1.18),
    "stretching": (0.7, 1.5),
    "bending": (0.4, 2.5),
}
"""Log-uniform factors on the nominal cloth."""
DAMPINGS = (0.25e-3, 5e-3)  # s, log-uniform
GENTLE = 1e-3
"""Of damping [s]: explicit steps of half a millisecond are stable up to it."""


@dataclass(frozen=True, kw_only=True)
class Undeclared:
    """Something that acts and is not declared.

    Attributes:
        title: in words.
        effect: what the library calls it; empty where it is not in the library, or is calibrated.
        strength: by the library's unit.
        air: that acts.
        rise: of the wind above the horizontal [rad].
        hem: mass along all edges [kg/m].
        damping: of the cloth [s]; None for that which was drawn.
    """

    title: str
    effect: str = ""
    strength: float = 0.0
    air: Air = field(default_factory=Air)
    rise: float = 0.0
    hem: float = 0.0
    damping: float | None = None


NOTHING = Undeclared(title="nothing")
UNDECLARED: Mapping[str, Undeclared] = {
    "pressure": Undeclared(
        title="pressure × 1.6", effect="air-density", strength=0.6, air=Air(pressure=1.6)
    ),
    "lift": Undeclared(
        title="lift", effect="lift", strength=2.0, air=Air(lift=0.5 * AIR_DENSITY * 2.0)
    ),
    "linear-drag": Undeclared(
        title="linear tangential drag",
        effect="tangential-linear-drag",
        strength=0.4,
        air=Air(linear=0.4),
    ),
    "quadratic-drag": Undeclared(
        title="quadratic tangential drag",
        effect="tangential-quadratic-drag",
        strength=0.05,
        air=Air(quadratic=AIR_DENSITY * 0.05),
    ),
    "rising-wind": Undeclared(
        title="wind that rises by 0.15 rad", effect="vertical-wind", strength=0.15, rise=0.15
    ),
    "hem": Undeclared(title="hem of 20 g/m", effect="hem-mass", strength=0.02, hem=0.02),
    "inertia": Undeclared(
        title="inertia of the air, a share of 0.2",
        effect="finite-span-loading",
        strength=0.2,
        air=Air(carried=AIR_DENSITY * 0.2),
        damping=0.5e-3,
    ),
    "damping": Undeclared(title="internal damping of 20 ms", damping=20e-3),
    "magnus": Undeclared(title="force across the wind (Magnus)", air=Air(side=0.12)),
    "wake": Undeclared(title="a pressure that lags by Wagner's function", air=Air(lag=1.0)),
}
"""By name. Damping is calibrated and not an effect; the last two are none that a verdict may name.
The inertia of the air needs MuJoCo's explicit steps, and so little damping."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Truth:
    """One experiment.

    Attributes:
        name: of it.
        sheet: that was simulated.
        method: it was simulated by.
        diagonals: of its mesh.
        speeds: of the declared winds, along +x [m/s].
        undeclared: what acted.
    """

    name: str
    sheet: Sheet
    method: Method
    diagonals: Diagonals
    speeds: tuple[float, ...]
    undeclared: Undeclared

    @property
    def factors(self) -> Mapping[str, float]:
        """Of the cloth on the nominal one."""
        return {name: getattr(self.sheet, name) / getattr(NOMINAL, name) for name in SPREAD}

    @property
    def damping(self) -> float:
        """Of slow modes [s]: the cloth's, and that of an implicit step, which damps as so much
        does."""
        return self.sheet.damping + (
            self.method.step if self.method.integrator is Integrator.DISCRETE else 0.0
        )


def draw(name: str, undeclared: Undeclared, *, seed: int) -> Truth:
    """An experiment by its name and seed: all but what acts is drawn."""
    rng = stream(seed, "foreign", name)
    factor = {
        key: math.exp(rng.uniform(math.log(low), math.log(high)))
        for key, (low, high) in SPREAD.items()
    }
    damping = math.exp(rng.uniform(*np.log(DAMPINGS)))
    diagonals = list(Diagonals)[rng.integers(2)]
    step = _STEPS[rng.integers(2)]
    shares = (np.arange(3) + rng.random(3)) / 3
    if undeclared.damping is not None:
        damping = undeclared.damping
    gentle = damping <= GENTLE
    mesh = grid(width=WIDTH, height=HEIGHT, columns=COLUMNS, rows=ROWS, diagonals=diagonals)
    sheet = replace(
        NOMINAL,
        mesh=mesh,
        held=handles.corners(mesh.rest),
        damping=damping,
        added=_hem(mesh.rest, undeclared.hem),
        **{key: getattr(NOMINAL, key) * value for key, value in factor.items()},
    )
    return Truth(
        name=name,
        sheet=sheet,
        diagonals=diagonals,
        undeclared=undeclared,
        method=Method() if gentle else Method(integrator=Integrator.DISCRETE, step=step),
        speeds=tuple(float(u) for u in SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * shares),
    )


def write(truth: Truth, folder: Path, *, python: Path, seed: int) -> Path:
    """Simulate an experiment and write it: a marker table for each wind, the material, and the
    recipe that is returned.

    Raises:
        UnusableError: the simulation failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rest = truth.sheet.mesh.rest
    seen = _markers(rest)
    u, v = rest.T
    start = np.stack([u * math.cos(_HEADING), u * math.sin(_HEADING), v], axis=1)
    rise = truth.undeclared.rise
    for speed in truth.speeds:
        made = fly(
            python,
            truth.sheet,
            start=start,
            air=truth.undeclared.air,
            method=truth.method,
            rate=RATE,
            wind=Wind(velocity=speed * np.array([[math.cos(rise), 0.0, math.sin(rise)]])),
            frames=round(DURATION * RATE),
            settle=round(SETTLE * RATE),
        )
        positions = made.positions[:, seen]
        jitter = stream(seed, "foreign", truth.name, "noise", _file(speed)).standard_normal(
            positions.shape
        )
        _table(folder / _file(speed), rest[seen], positions + NOISE * jitter)
    (folder / "cloth.toml").write_text(material_text(), encoding="utf-8")
    recipe = folder / "experiment.toml"
    recipe.write_text(_recipe(truth.speeds), encoding="utf-8")
    return recipe


def material_text() -> str:
    """The nominal cloth as a material file: entries that act as this membrane and these hinges do.

    The tables' entries count twice in the membrane, whose energy density is (k0 G00² + 2 k1 G00 G11
    + k2 G11² + 2 k3 G01²)/2, and hinges of an entry k store k/4 κ²/2 in a cylinder.
    """
    plain = NOMINAL.stretching / (1 - NOMINAL.poisson**2)
    row = [
        plain / 2,
        NOMINAL.poisson * plain / 2,
        plain / 2,
        NOMINAL.stretching / (1 + NOMINAL.poisson) / 2,
    ]
    bending = [4 * NOMINAL.bending] * 5
    return (
        f'source = "constant stiffness"\narea-weight = {NOMINAL.area_weight}\ndamping = '
        f"{NOMINAL.damping}\n"
        f"stretching = {[row] * 6}\nbending = {[bending] * 3}\n"
    )


def _recipe(speeds: Sequence[float]) -> str:
    head = (
        f'[cloth]\nwidth = {WIDTH}\nheight = {HEIGHT}\n\n[material]\nfile = "cloth.toml"\n\n'
        '[attachment]\nat = "hoist-corners"\nrigid = true\n'
    )
    parts = [
        f'\n[[recording]]\nsource = "{_file(speed)}"\nname = "{speed:.3g} m/s"\nrate = '
        f"{RATE}\nnoise = {NOISE}\n"
        f"wind = {{ speed = {speed!r} }}\n"
        for speed in speeds
    ]
    return head + "".join(parts)


def _file(speed: float) -> str:
    return f"wind-{1e3 * speed:.0f}mm-s.csv"


def _markers(rest: FloatArray) -> IntArray:
    """Every `SEEN`-th vertex of the grid, by its place."""
    column, row = (
        np.rint(rest[:, axis] / size * cells)
        for axis, size, cells in ((0, WIDTH, COLUMNS), (1, HEIGHT, ROWS))
    )
    return np.flatnonzero((column % SEEN == 0) & (row % SEEN == 0))


def _hem(rest: FloatArray, area_weight: float) -> FloatArray | None:
    """(vertex,) mass of a hem around the cloth, of so much for each metre, half of each edge at its
    ends [kg]."""
    if not area_weight:
        return None
    length = np.zeros(len(rest))
    for across, along, cells in ((0, 1, ROWS), (1, 0, COLUMNS)):
        size, extent = (WIDTH, HEIGHT)[across], (WIDTH, HEIGHT)[along]
        beside = np.minimum(rest[:, across], size - rest[:, across]) < 1e-9
        at_end = np.minimum(rest[:, along], extent - rest[:, along]) < 1e-9
        length += np.where(beside, extent / cells * np.where(at_end, 0.5, 1.0), 0.0)
    return area_weight * length


def _table(path: Path, rest: FloatArray, positions: FloatArray) -> None:
    frames, markers = positions.shape[:2]
    columns = {
        "frame": np.repeat(np.arange(frames), markers),
        "marker": np.tile(np.arange(markers), frames),
        "u": np.tile(rest[:, 0], frames),
        "v": np.tile(rest[:, 1], frames),
        **{axis: positions[:, :, place].ravel() for place, axis in enumerate("xyz")},
    }
    csv.write_csv(pa.table(columns), path)
