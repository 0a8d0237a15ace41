"""A data set of other counts than its recipe states: sequences and films dealt to the sides in the recipe's shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flagdata.errors import UsageError
from flagdata.rng import child_seed
from sim.datasets.recipe import DatasetRecipe


def with_counts(recipe: DatasetRecipe, *, sequences: int | None, films: int | None) -> DatasetRecipe:
    """Returns the recipe with so many sequences and films in all, which is another data set: its name says the counts,
    and its seed is its own, so that a lake can hold several.

    Args:
        sequences: of all sides together; None for as many as the recipe has.
        films: of all sides together; None for as many a sequence as the recipe has.

    Raises:
        UsageError: fewer sequences than sides, or fewer films than sequences.
    """
    if sequences is None and films is None:
        return recipe
    before = sum(side.sequences for side in recipe.sides)
    sequences = before if sequences is None else sequences
    if films is None:
        films = max(sequences, round(sum(side.renders for side in recipe.sides) * sequences / before))
    if sequences < len(recipe.sides):
        raise UsageError(
            f"{sequences} sequences cannot be on {len(recipe.sides)} sides",
            where="--sequences",
            fix=f"give --sequences {len(recipe.sides)} or more: {', '.join(side.name for side in recipe.sides)}",
        )
    if films < sequences:
        raise UsageError(
            f"{films} films are fewer than the {sequences} sequences, and each sequence is filmed",
            where="--films",
            fix=f"give --films {sequences} or more, or --sequences {films} or fewer",
        )
    of_sides = _dealt(sequences, [side.sequences for side in recipe.sides], least=[1] * len(recipe.sides))
    filmed = _dealt(films, [side.renders for side in recipe.sides], least=of_sides)
    sides = tuple(
        replace(
            side,
            sequences=count,
            renders=renders,
            sessions=side.sessions and max(1, min(count, round(side.sessions * count / side.sequences))),
        )
        for side, count, renders in zip(recipe.sides, of_sides, filmed, strict=True)
    )
    if sides == recipe.sides:
        return recipe
    seed = child_seed(recipe.seed, "counts", sequences, films)
    return replace(recipe, name=f"{recipe.name}-{sequences}x{films}", seed=seed, sides=sides)


def _dealt(total: int, shares: Sequence[int], *, least: Sequence[int]) -> list[int]:
    """Divides a total in proportion to shares, none below its least, the largest remainders first."""
    exact = [total * share / sum(shares) for share in shares]
    counts = [max(floor, int(part)) for floor, part in zip(least, exact, strict=True)]
    while sum(counts) < total:
        most = max(range(len(counts)), key=lambda side: exact[side] - counts[side])
        counts[most] += 1
    while sum(counts) > total:
        most = max(range(len(counts)), key=lambda side: (counts[side] > least[side], counts[side] - exact[side]))
        counts[most] -= 1
    return counts
