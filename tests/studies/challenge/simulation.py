"""Simulates recordings of sets that share their numerics, as one batch: effects are at null where
they do not act."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.rng import stream
from flagdata.errors import FlagdataError, UsageError
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles, corners
from sim.cloth.material import Material, named_material
from sim.cloth.scene import Scene, assemble, roughen_start
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import Effect, Gusts, apply
from sim.integrate import BackwardEuler, Integrator, Symplectic
from sim.run.simulation_loop import Batch, DivergedError, Divergence
from sim.wind import Beyond, Even, SampledWind, VonKarman
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.meshes import mesh_of
from tests.studies.challenge.recipe import ChallengeRecipe, Method, Numerics, effect_type

WIDEST = 15
"""Recordings in a batch: the compiled kernel's lanes."""
INSTANTS = 6
HORIZON = 0.1
_OUTER = 4e-3  # s; of the forces beside the base model, halved where they change faster
_SHORTEST_OUTER = 1e-4
_HALVINGS = 3
_START_NOISE = 2e-3  # m
_GUST_RATE = 10.0  # Hz


@dataclass(frozen=True, kw_only=True)
class SimulatedSet:
    """What a set's cloth did.

    Attributes:
        positions: one (frame, vertex, 3) for each recording, the lower attachment at the origin
            [m].
        winds: one (sample, 3) for each recording: one sample where it is steady, else at the log's
            rate [m/s].
        effects: what acted, with the strengths that were simulated.
        impact: see `AnswerKey`.
    """

    positions: tuple[Float32Array, ...]
    winds: tuple[FloatArray, ...]
    effects: tuple[Acting, ...]
    impact: float


def batches(keys: Sequence[AnswerKey], recordings: int) -> list[tuple[AnswerKey, ...]]:
    """Sets that are simulated together: one mesh, as many recordings as fit, and few different
    effects."""
    groups: dict[str, list[AnswerKey]] = {}
    for key in sorted(keys, key=lambda key: [acting.effect for acting in key.effects]):
        groups.setdefault(key.numerics, []).append(key)
    each = max(1, WIDEST // recordings)
    return [
        tuple(group[i : i + each]) for group in groups.values() for i in range(0, len(group), each)
    ]


def simulate(
    recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey]
) -> dict[str, SimulatedSet]:
    """Set → what its cloth did. The clock of the effects starts with the run, `settle` before the
    first frame.

    Some effects feed the cloth with energy and, at some strengths, tear it apart. The strengths of
    a set that diverges are halved, three times at most.

    Raises:
        FlagdataError: a flag diverged all the same.
    """
    return _tried(recipe, seed, keys, _HALVINGS)


def _tried(
    recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey], halvings: int
) -> dict[str, SimulatedSet]:
    try:
        return _simulated(recipe, seed, keys)
    except DivergedError as error:
        place, seconds = error.member // recipe.count, error.time
    key = keys[place]
    if not halvings:
        raise FlagdataError(
            f"the cloth diverged {seconds:.2f} s after its run began",
            where=f"{key.name}, numerics {key.numerics!r}",
            fix="narrow the recipe's ranges of damping or of that effect",
        )
    weaker = replace(key, effects=tuple(map(_halved, key.effects)))
    return _tried(recipe, seed, [*keys[:place], weaker, *keys[place + 1 :]], halvings - 1)


def _halved(acting: Acting) -> Acting:
    null = float(effect_type(acting.effect).parameters()[acting.parameter].null)
    return replace(acting, value=null + (acting.value - null) / 2)


def _simulated(
    recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey]
) -> dict[str, SimulatedSet]:
    numerics = recipe.numerics[keys[0].numerics]
    winds = {key.name: _winds(recipe, seed, key) for key in keys}
    base, start = _base(recipe, seed, numerics, keys, winds)
    names = dict.fromkeys(acting.effect for key in keys for acting in key.effects)
    effects = [_effect(recipe, seed, keys, name) for name in names]
    with torch.no_grad():
        system, state = apply(effects, base, start)
        stepper = _Stepper.of(numerics)
        frames, snapshots = _run(recipe, keys, stepper, system, state)
        impact = (
            _impacts(stepper, system, base, snapshots) if effects else torch.zeros(base.cloth.batch)
        )
    result: dict[str, SimulatedSet] = {}
    for place, key in enumerate(keys):
        members = range(place * recipe.count, (place + 1) * recipe.count)
        ticks = recipe.ticks // key.rate * np.arange(_frames(recipe, key))
        positions = tuple(
            np.stack([frames[int(tick)][:, :, member] for tick in ticks]) for member in members
        )
        settled = tuple(
            wind[round(recipe.settle * recipe.log_rate) :] if len(wind) > 1 else wind
            for wind in winds[key.name]
        )
        square = float((impact[list(members)] ** 2).mean())
        result[key.name] = SimulatedSet(
            positions=positions, winds=settled, effects=key.effects, impact=math.sqrt(square)
        )
    return result


def material_of(key: AnswerKey) -> Material:
    """The set's true cloth."""
    return replace(
        named_material(key.material).scaled(area_weight=key.density, bending=key.bending),
        damping=key.damping,
    )


def _frames(recipe: ChallengeRecipe, key: AnswerKey) -> int:
    return round(recipe.duration * key.rate)


def _winds(recipe: ChallengeRecipe, seed: int, key: AnswerKey) -> tuple[FloatArray, ...]:
    """The wind of each recording (sample, 3) [m/s], from the start of the run."""
    direction = np.array([math.cos(key.toward), math.sin(key.toward), 0.0])
    if not key.intensity:
        return tuple(speed * direction[None] for speed in key.speeds)
    duration = recipe.settle + recipe.duration
    count = round(duration * recipe.log_rate) + 1
    if recipe.films is not None:
        return tuple(
            _turbulent(recipe, key, count, stream(seed, "wind", index), speed)
            for index, speed in enumerate(key.speeds)
        )
    series = [
        VonKarman(mean=speed, intensity=key.intensity, length=recipe.length).series(
            stream(seed, key.name, "wind", index),
            duration=count / recipe.log_rate,
            rate=recipe.log_rate,
        )
        for index, speed in enumerate(key.speeds)
    ]
    return tuple(s[:, None] * direction for s in series)


def _turbulent(
    recipe: ChallengeRecipe, key: AnswerKey, count: int, rng: np.random.Generator, speed: float
) -> FloatArray:
    """(sample, 3) of a wind along +x that is turbulent across and upwards as well, the same in all
    sets [m/s]."""
    gusts = Gusts(intensity=key.intensity)
    series = (
        gusts.with_series(
            rng,
            batch=1,
            speed=speed,
            length=recipe.length,
            duration=(count - 1) / recipe.log_rate,
            rate=recipe.log_rate,
        )
        .samples[:count, :, 0]
        .numpy()
        .T
    )
    parts = (
        np.array([1.0, float(gusts.lateral), float(gusts.vertical)])[:, None]
        * key.intensity
        * speed
        * series
    )
    return parts.T + np.array([speed, 0.0, 0.0])


def _base(
    recipe: ChallengeRecipe,
    seed: int,
    numerics: Numerics,
    keys: Sequence[AnswerKey],
    winds: dict[str, tuple[FloatArray, ...]],
) -> tuple[System, State]:
    mesh = mesh_of(numerics, width=recipe.width, height=recipe.height)
    handles = Handles(vertices=corners(mesh.rest))
    contact = Contact(thickness=numerics.thickness) if numerics.thickness else None
    scenes = [
        Scene(
            mesh=mesh,
            position=_start(mesh.rest, key, stream(seed, key.name, "start", index), handles),
            material=material_of(key),
            handles=handles,
            wind=tuple(winds[key.name][index].mean(axis=0).tolist()),
            contact=contact,
        )
        for key in keys
        for index in range(recipe.count)
    ]
    system, state = assemble(scenes)
    if not any(key.intensity for key in keys):
        return system, state
    count = round((recipe.settle + recipe.duration) * recipe.log_rate) + 1
    each = [np.broadcast_to(wind, (count, 3)) for key in keys for wind in winds[key.name]]
    samples = torch.as_tensor(np.stack(each, axis=-1), dtype=system.cloth.dtype)
    times = Even(start=0.0, period=1 / recipe.log_rate, count=count)
    return replace(
        system, wind=SampledWind(times=times, samples=samples, beyond=Beyond.HOLD)
    ), state


def heading(key: AnswerKey) -> FloatArray:
    """(3,) unit vector from the pole to where the flag starts."""
    angle = key.toward + key.heading
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def _start(
    rest: FloatArray, key: AnswerKey, rng: np.random.Generator, handles: Handles
) -> FloatArray:
    flat = rest[:, :1] * heading(key) + rest[:, 1:] * np.array([0.0, 0.0, 1.0])
    return roughen_start(flat, handles, rng, _START_NOISE)


def _effect(recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey], name: str) -> Effect:
    """An effect with its value for each recording, null in sets in which it does not act."""
    kind = effect_type(name)
    acting = [next((a for a in key.effects if a.effect == name), None) for key in keys]
    parameter = next(a.parameter for a in acting if a is not None)
    null = kind.parameters()[parameter].null
    each = [null if a is None else a.value for a in acting for _ in range(recipe.count)]
    effect: Effect = kind(**{parameter: torch.tensor(each, dtype=torch.float64)})
    if not isinstance(effect, Gusts):
        return effect
    duration = recipe.settle + recipe.duration + 2 * HORIZON + 1 / _GUST_RATE
    series = [
        effect.with_series(
            stream(seed, key.name, "gusts", index),
            batch=1,
            speed=speed,
            length=recipe.length,
            duration=duration,
            rate=_GUST_RATE,
        )
        for key in keys
        for index, speed in enumerate(key.speeds)
    ]
    return replace(
        effect, times=series[0].times, samples=torch.cat([s.samples for s in series], dim=-1)
    )


@dataclass(frozen=True, kw_only=True)
class _Stepper:
    """Advances systems, with shorter outer steps where what acts beside the base model asks for
    them."""

    method: BackwardEuler | Symplectic

    @classmethod
    def of(cls, numerics: Numerics) -> _Stepper:
        if numerics.integrator is Method.IMPLICIT:
            return cls(method=BackwardEuler(step=numerics.step))
        return cls(method=Symplectic(outer=_OUTER))

    def advance(self, system: System, state: State, duration: float) -> State:
        method: Integrator = self.method
        while True:
            try:
                return method.advance(system, state, duration)
            except UsageError:
                if (
                    not isinstance(method, Symplectic)
                    or method.outer is None
                    or method.outer < _SHORTEST_OUTER
                ):
                    raise
                method = replace(method, outer=method.outer / 2)


def _run(
    recipe: ChallengeRecipe,
    keys: Sequence[AnswerKey],
    stepper: _Stepper,
    system: System,
    state: State,
) -> tuple[dict[int, Float32Array], list[State]]:
    """Tick → positions (vertex, 3, batch), and states at some instants."""
    ticks, settle = recipe.ticks, round(recipe.settle * recipe.ticks)
    wanted = {ticks // key.rate * frame for key in keys for frame in range(_frames(recipe, key))}
    span = round(recipe.duration * ticks)
    instants = {round(span * (i + 0.5) / INSTANTS) for i in range(INSTANTS)}
    stops = {
        ticks // recipe.log_rate * i - settle
        for i in range(1, (settle + span) * recipe.log_rate // ticks)
    }
    frames: dict[int, Float32Array] = {}
    snapshots: list[State] = []
    batch = Batch(system=system, state=state, integrator=stepper, divergence=Divergence.REFUSE)
    numbers = [
        tick + settle
        for tick in sorted(wanted | instants | {stop for stop in stops if stop < span})
    ]
    for number, at in zip(numbers, batch.states(numbers, ticks), strict=True):
        if number - settle in wanted:
            frames[number - settle] = at.position.numpy().copy()
        if number - settle in instants:
            snapshots.append(at)
    return frames, snapshots


def _impacts(stepper: _Stepper, system: System, base: System, snapshots: Sequence[State]) -> Tensor:
    """(batch,) see `AnswerKey.impact`."""
    total = torch.zeros(base.cloth.batch, dtype=torch.float64)
    for state in snapshots:
        acted = stepper.advance(system, state, HORIZON)
        plain = stepper.advance(base, replace(state, memory=()), HORIZON)
        total = total + ((acted.position - plain.position).double() ** 2).sum(1).mean(0)
    return (total / len(snapshots)).sqrt()
