"""How far data and nulls go the way of one effect, and nulls on which effects act: what the test
would see of each.

An effect's pull is the root of its column's drop over what is left with it, with the sign of its
coefficient. Along it alone is tested where it was suspected beforehand: then only its own sign
counts, and nothing of all other columns.

Power is found in the nulls of a verdict themselves: their r moves by their response times the
strength, as far as appears in recordings (`APPEARS`), and goes through the test as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.forecasting.strengths import on_markers
from measure.inference.segment_evidence import Evidence

APPEARS = 0.25
"""Share of a shift that the fit's mesh expects of an effect which appears in recordings of other
meshes: the median of twelve, 0 to 0.55 (decision 062). Most of the sensitivity of a forecast is the
mesh's own chaos."""
NOTHING = 1e-6
"""Mean share below which a column is unobservable: that of the columns that are always fitted."""


@dataclass(frozen=True, kw_only=True)
class Move:
    """An effect that acts on nulls.

    Attributes:
        column: its place among the columns.
        name: effect.parameter.
        strength: beyond null, as it is expected.
    """

    column: int
    name: str
    strength: float

    @property
    def sign(self) -> int:
        """1 for more of it, −1 for less."""
        return 1 if self.strength > 0 else -1


def moves(columns: tuple[str, ...]) -> list[Move]:
    """Lists the moves of all effects that are weighed, at their expected strengths of each sign
    that they may have."""
    return [
        Move(
            column=columns.index(strengths.name),
            name=strengths.name,
            strength=sign * strengths.expected,
        )
        for strengths in on_markers()
        for sign in strengths.signs
        if strengths.name in columns
    ]


def pulls_of(evidence: Evidence) -> FloatArray:
    """Computes the root of each column's drop over what is left with it, with the sign of its
    coefficient, (column, part); parts are the errors', and their moments' about the pole where
    these are looked at."""
    parts = [evidence] if evidence.turning is None else [evidence, evidence.turning]
    fits = [(part.pulls(), part.fit(()).remainder) for part in parts]
    return np.stack(
        [np.sign(pulls) * np.sqrt(shares_of(pulls**2, remainder)) for pulls, remainder in fits],
        axis=1,
    )


def standardise_pulls(pulls: FloatArray, centre: FloatArray, width: FloatArray) -> FloatArray:
    """Standardises (…, column, part) pulls: less what is usual, over how much they vary; −∞ where
    nothing is seen."""
    return np.where(
        width > np.cbrt(NOTHING), (pulls - centre) / np.maximum(width, np.cbrt(NOTHING)), -np.inf
    )


def pull_along(pulls: FloatArray, column: int, sign: int) -> FloatArray:
    """Computes how far standardised pulls (group, column, part) go the way of one effect, by the
    farther part, (group,)."""
    of_column = pulls[:, column]
    return np.where(np.isfinite(of_column), sign * of_column, -np.inf).max(axis=1)


def shares_of(drops: FloatArray, misfit: float) -> FloatArray:
    """Divides drops by what is left with each."""
    return drops / np.maximum(misfit - drops, 1e-9)
