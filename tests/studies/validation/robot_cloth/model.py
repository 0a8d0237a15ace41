"""A held cloth by the base model: its corners go where the tool takes them, still air resists it,
gravity pulls."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import UsageError
from sim.cloth import handles
from sim.cloth.anchors import AnchorTracks
from sim.cloth.handles import Handles
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble
from sim.effects import EFFECTS, Effect, Parameter, apply
from sim.integrate import BackwardEuler, SplitEuler
from tests.studies.validation.robot_cloth.reading import Swing
from tests.studies.validation.robot_cloth.tracker import instants

PERIOD = 0.02  # s, of predictions and of the corners' tracks
_SETTLE = 2.0  # s that a cloth hangs still before the first pose
_STEP = 5e-3  # s, of backward Euler
NAMES = ("density", "bending", "damping", "lag")


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """What is calibrated.

    Attributes:
        density, bending: factors on the nominal cloth. In still air only forces by mass show: a
            density stands for the ratio of mass to the air's drag, bending for its own to the mass.
        damping: internal [s].
        lag: by which the camera's stamps are later than the tool's [s].
        strengths: effect of the library → its strength, in its own unit; none is there without.
    """

    density: float = 1.0
    bending: float = 1.0
    damping: float = 2.5e-3
    lag: float = 0.0
    strengths: Mapping[str, float] = field(default_factory=dict)

    def moved(self, steps: Sequence[float]) -> Parameters:
        """By steps in ln density, ln bending, ln damping, seconds of lag and, in their order, the
        effects' strengths.

        A strength stays among those that make sense.
        """
        density, bending, damping, lag, *effects = steps
        return Parameters(
            density=self.density * math.exp(density),
            bending=self.bending * math.exp(bending),
            damping=self.damping * math.exp(damping),
            lag=self.lag + lag,
            strengths={
                name: described(name).nearest(value + step)
                for (name, value), step in zip(self.strengths.items(), effects, strict=True)
            },
        )


def described(effect: str) -> Parameter:
    """The one strength of an effect of the library.

    Raises:
        UnknownNameError: no such effect.
        UsageError: it has several strengths.
    """
    kind = EFFECTS[effect]
    if len(kind.strengths()) != 1:
        raise UsageError(
            f"{len(kind.strengths())} strengths",
            where=f"effect {effect!r}",
            fix="name one with a single one",
        )
    return kind.parameters()[kind.strengths()[0]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Cloth:
    """The cloth that recordings show.

    Attributes:
        material: nominal.
        width, height: of the square of nodes [m].
        side: nodes along each edge.
        hanging: (node, 3) where the nodes hang at rest, from the tool's first place [m].
        cells: of the mesh from one node to the next.
    """

    material: Material
    width: float
    height: float
    side: int
    hanging: FloatArray
    cells: int = 1

    @classmethod
    def seen(cls, swings: Sequence[Swing], material: Material) -> Cloth:
        """Its size and its attachments are those of the square of nodes as they hang at rest,
        medians over recordings: the robot's grip is the same in all of them, and the tracker's
        corners are off by centimetres in some."""
        hanging = np.median([swing.hanging - swing.tool[0] for swing in swings], axis=0)
        side = swings[0].side
        places = hanging.reshape(side, side, 3)
        return cls(
            material=material,
            width=float(np.linalg.norm(places[-1, 0] - places[0, 0])),
            side=side,
            hanging=hanging,
            height=float(np.median(np.linalg.norm(places[:, 0] - places[:, -1], axis=1))),
        )

    @property
    def upper(self) -> tuple[int, int]:
        """The nodes at the upper corners, left and right."""
        return 0, self.side * (self.side - 1)

    def carried(self, swing: Swing, nodes: Sequence[int]) -> FloatArray:
        """(pose, node, 3) where the tool takes nodes as if they were fixed to it [m]."""
        return (
            np.einsum("tij,nj->tni", swing.turns, self.hanging[list(nodes)]) + swing.tool[:, None]
        )

    @property
    def mesh(self) -> Mesh:
        """A vertex at each node, and `cells` cells from one to the next; v from bottom to top."""
        cells = self.cells * (self.side - 1)
        return grid(width=self.width, height=self.height, columns=cells, rows=cells)

    def nodes(self, mesh: Mesh) -> IntArray:
        """(node,) vertices at the nodes: columns from left to right, each from top to bottom."""
        place = np.arange(self.side) / (self.side - 1)
        u, v = np.meshgrid(place * self.width, self.height * (1 - place), indexing="ij")
        wanted = np.stack([u.ravel(), v.ravel()], axis=1)
        return np.linalg.norm(mesh.rest[None] - wanted[:, None], axis=2).argmin(axis=1)


def predicted(
    cloth: Cloth, swings: Sequence[Swing], parameters: Sequence[Parameters]
) -> list[CubicSpline]:
    """The nodes' places by a model of each recording, over the tool's time: splines to (node, 3)
    [m].

    All recordings run side by side as members of a batch. The cloth hangs still before the tool's
    first pose.
    """
    mesh = cloth.mesh
    held = handles.top_corners(mesh.rest)
    start = [_hung(mesh, held, *cloth.carried(swing, cloth.upper)[0]) for swing in swings]
    scenes = [
        Scene(
            mesh=mesh,
            position=own,
            handles=Handles(vertices=held, stiffness=math.inf),
            material=replace(
                cloth.material.scaled(area_weight=p.density, bending=p.bending), damping=p.damping
            ),
        )
        for own, p in zip(start, parameters, strict=True)
    ]
    system, state = assemble(scenes)
    last = max(float(swing.tool_times[-1]) for swing in swings)
    times = np.arange(math.ceil(last / PERIOD) + 1, dtype=np.float64) * PERIOD
    tracks = np.stack([_track(cloth, swing, times) for swing in swings], axis=-1)
    motion = AnchorTracks(
        start=0.0, period=PERIOD, samples=torch.as_tensor(tracks, dtype=state.position.dtype)
    )
    system, state = apply(
        _effects(parameters, state.position.dtype), replace(system, motion=motion), state
    )
    integrator, nodes = (
        SplitEuler(base=BackwardEuler(step=_STEP, tolerance=1e-4)),
        torch.as_tensor(cloth.nodes(mesh)),
    )
    state = replace(integrator.advance(system, replace(state, time=-_SETTLE), _SETTLE), time=0.0)
    frames = [state.position[nodes].double()]
    with torch.no_grad():
        for _ in times[1:]:
            state = integrator.advance(system, state, PERIOD)
            frames.append(state.position[nodes].double())
    found = torch.stack(frames).numpy()
    return [CubicSpline(times, found[..., member]) for member in range(len(swings))]


def rigid(cloth: Cloth, swing: Swing, lag: float) -> FloatArray:
    """(frame, node, 3) observed less what a board would do that hangs from the tool as the cloth
    does at rest [m]."""
    board = CubicSpline(swing.tool_times, cloth.carried(swing, range(cloth.side**2)))
    return swing.positions - board(instants(swing, lag))


def _effects(parameters: Sequence[Parameters], dtype: torch.dtype) -> list[Effect]:
    """Each effect that any member has, with every member's strength."""
    made: list[Effect] = []
    for name in dict.fromkeys(name for own in parameters for name in own.strengths):
        values = [own.strengths.get(name, described(name).null) for own in parameters]
        made.append(
            EFFECTS[name](**{EFFECTS[name].strengths()[0]: torch.tensor(values, dtype=dtype)})
        )
    return made


def _track(cloth: Cloth, swing: Swing, times: FloatArray) -> FloatArray:
    """(n, 2, 3) displacement of the corners at times [m]; still after the last pose."""
    corners = cloth.carried(swing, cloth.upper)
    return (
        CubicSpline(swing.tool_times, corners)(np.minimum(times, swing.tool_times[-1])) - corners[0]
    )


def _hung(mesh: Mesh, held: tuple[int, int], left: FloatArray, right: FloatArray) -> FloatArray:
    """(vertex, 3) the cloth hanging straight down from its corners [m]."""
    u, v = mesh.rest.T
    share = (u / u.max())[:, None]
    position = (1 - share) * left + share * right
    position[:, 2] -= v.max() - v
    position[list(held)] = left, right
    return position
