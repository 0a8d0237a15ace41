"""Draws the keys of a challenge: the contents of each set, from named streams of one seed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import TypeVar

import numpy as np

from flagdata.core.rng import stream
from flagdata.errors import UsageError
from sim.effects import ClothEffect
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.classes import class_of
from tests.studies.challenge.recipe import (
    ChallengeRecipe,
    Kind,
    Method,
    SetDesign,
    Strengths,
    effect_type,
)

T = TypeVar("T")
_HEADING = 0.5  # rad: how far from downwind a flag starts


def composition(recipe: ChallengeRecipe, count: int) -> dict[Kind, int]:
    """How many sets of each kind, by largest remainders."""
    total = sum(recipe.composition.values())
    exact = {kind: count * share / total for kind, share in recipe.composition.items()}
    dealt = {kind: math.floor(value) for kind, value in exact.items()}
    by_remainder = sorted(Kind, key=lambda kind: (dealt[kind] - exact[kind], kind.value))
    for kind in by_remainder[: count - sum(dealt.values())]:
        dealt[kind] += 1
    return dealt


def draw(recipe: ChallengeRecipe, *, seed: int, count: int) -> tuple[AnswerKey, ...]:
    """The keys of `count` sets, in the order of their names, which says nothing; impacts are not
    known yet.

    Effects, designs, noises, rates and strengths that are fixed beforehand are dealt out evenly,
    everything else is drawn for each set.

    Raises:
        UsageError: fewer than one set.
    """
    if count < 1:
        raise UsageError(
            f"a challenge of {count} sets", where="challenge", fix="ask for one or more"
        )
    number = composition(recipe, count)

    def deal(what: str, cards: Sequence[T], wanted: int) -> list[T]:
        return _deal(stream(seed, "deal", what), cards, wanted)

    groups: list[tuple[Kind, tuple[str, ...]]] = [(Kind.NULL, ())] * number[Kind.NULL]
    groups += [(Kind.ONE, (name,)) for name in deal("one", list(recipe.effects), number[Kind.ONE])]
    groups += [(Kind.PAIR, pair) for pair in deal("pair", _pairs(recipe), number[Kind.PAIR])]
    groups += [
        (Kind.OUTSIDE, (name,))
        for name in deal("outside", list(recipe.outside), number[Kind.OUTSIDE])
    ]

    nulls = iter(deal("numerics of nulls", list(recipe.numerics), number[Kind.NULL]))
    rates, noises = deal("rate", recipe.rates, count), deal("noise", recipe.noises, count)
    designs = deal("design", list(recipe.designs.values()), count if recipe.designs else 0)
    varying = deal("wind", [index < round(10 * recipe.varying) for index in range(10)], count)
    order = stream(seed, "order").permutation(count)
    turns = [groups[:index].count(group) for index, group in enumerate(groups)]
    keys: list[AnswerKey] = []
    for place, index in enumerate(order.tolist()):
        kind, effects = groups[index]
        numerics = next(nulls) if kind is Kind.NULL else _numerics(recipe, seed, kind, effects)
        key = _key(
            recipe,
            stream(seed, "set", index),
            name=f"set-{place + 1:03d}",
            kind=kind,
            effects=effects,
            turn=None if kind is Kind.PAIR else turns[index],
            numerics=numerics,
            rate=rates[index],
            noise=noises[index],
            varying=varying[index],
            shared=None if recipe.films is None else stream(seed, "winds"),
        )
        if recipe.designs:
            key = _of_design(key, designs[index], stream(seed, "design", index))
        keys.append(key)
    return tuple(keys)


def _of_design(key: AnswerKey, design: SetDesign, rng: np.random.Generator) -> AnswerKey:
    """A key whose cloth, rate, noise and wind are those of a design; a cloth that was weighed
    differs from its nominal weight by the error of the scale."""
    weighed, share = float(rng.standard_normal()), float(rng.random())
    density = math.exp(design.weight_sigma * weighed) if design.weight_sigma else key.density
    return replace(
        key,
        material=design.material,
        rate=design.rate,
        noise=design.noise,
        density=density,
        intensity=0.0 if design.intensity is None else design.intensity.at(share),
    )


def _deal(rng: np.random.Generator, cards: Sequence[T], wanted: int) -> list[T]:
    """So many cards, each as often as any other to within one."""
    dealt: list[T] = []
    while len(dealt) < wanted:
        dealt += [cards[i] for i in rng.permutation(len(cards))]
    return dealt[:wanted]


def _pairs(recipe: ChallengeRecipe) -> list[tuple[str, ...]]:
    """Two effects that are not of one class."""
    return [
        pair for pair in combinations(recipe.effects, 2) if class_of(pair[0]) != class_of(pair[1])
    ]


def _numerics(recipe: ChallengeRecipe, seed: int, kind: Kind, effects: tuple[str, ...]) -> str:
    """The same for all sets with the same effects, which are simulated together. Only a changed
    cloth takes implicit
    steps: forces beside the base model are too dear in them."""
    explicit = [
        name
        for name, numerics in recipe.numerics.items()
        if numerics.integrator is Method.SYMPLECTIC
    ]
    of_cloth = all(issubclass(effect_type(name), ClothEffect) for name in effects)
    allowed = list(recipe.numerics) if of_cloth or not explicit else explicit
    return allowed[int(stream(seed, "numerics", kind.value, *effects).integers(len(allowed)))]


def _key(
    recipe: ChallengeRecipe,
    rng: np.random.Generator,
    *,
    name: str,
    kind: Kind,
    effects: tuple[str, ...],
    turn: int | None,
    numerics: str,
    rate: int,
    noise: float,
    varying: bool,
    shared: np.random.Generator | None,
) -> AnswerKey:
    material = recipe.materials[int(rng.integers(len(recipe.materials)))]
    density, bending = recipe.density.at(rng.random()), recipe.bending.at(rng.random())
    damping = recipe.numerics[numerics].damping.at(rng.random())
    intensity = recipe.intensity.at(rng.random())
    table = recipe.outside if kind is Kind.OUTSIDE else recipe.effects
    key = AnswerKey(
        name=name,
        kind=kind,
        effects=tuple(_acting(effect, table[effect], turn, rng.random) for effect in effects),
        impact=0.0,
        material=material,
        density=density,
        bending=bending,
        damping=damping,
        speeds=_speeds(recipe, rng),
        toward=float(rng.uniform(-math.pi, math.pi)),
        heading=float(rng.uniform(-_HEADING, _HEADING)),
        intensity=intensity if varying else 0.0,
        rate=rate,
        noise=noise,
        numerics=numerics,
    )
    if shared is None:
        return key
    intensity = recipe.intensity.at(shared.random()) if recipe.varying else 0.0
    return replace(key, toward=0.0, speeds=_speeds(recipe, shared), intensity=intensity)


def _acting(
    effect: str, strengths: Strengths, turn: int | None, uniform: Callable[[], float]
) -> Acting:
    size = strengths.size(turn, uniform())
    value = -size if uniform() < strengths.negative else size
    unit = effect_type(effect).parameters()[strengths.parameter].unit
    return Acting(effect=effect, parameter=strengths.parameter, value=value, unit=unit)


def _speeds(recipe: ChallengeRecipe, rng: np.random.Generator) -> tuple[float, ...]:
    """Uniform among all that are far enough apart, in any order."""
    spare = recipe.speed.high - recipe.speed.low - (recipe.count - 1) * recipe.apart
    ordered = (
        recipe.speed.low
        + np.sort(rng.uniform(0, spare, recipe.count))
        + recipe.apart * np.arange(recipe.count)
    )
    return tuple(float(value) for value in rng.permutation(ordered))
