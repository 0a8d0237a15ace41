"""What an effect changes, by pairs of simulations whose law is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from measure.cloth import AZIMUTH, CLOTH, ELEVATION, NUISANCES, Emulator, Flag, draws, weighable
from measure.cloth.emulator import regressors
from measure.cloth.sight import Response, response_of

DRAG = next(
    one
    for one in weighable(Flag(length=1.5, height=1.0))
    if one.name == "tangential-linear-drag.coefficient"
)
COUNT, PAIRS, SUMMARIES = 512, 512, 6


def response(rng: np.random.Generator, *, own: float, again: bool) -> Response:
    """Of an effect that adds 3 u to each summary, by many pairs.

    Args:
        own: variance that flags with the effect have beside.
        again: whether chaos makes what is not regressed on another one in the flag with the effect.
    """
    values = dict(draws((*CLOTH, *NUISANCES, AZIMUTH, ELEVATION), COUNT, seed=1, name="model"))
    law = rng.standard_normal((regressors(values).shape[1], SUMMARIES))
    exact = regressors(values) @ law
    noise, other = rng.standard_normal((2, COUNT, SUMMARIES))
    emulator = Emulator.fit(values, exact + noise, np.ones(SUMMARIES, dtype=np.bool_), name="made")
    strengths = DRAG.prior.at(rng.random(PAIRS))
    effect = 3 * (strengths / DRAG.high)[:, None] + math.sqrt(own) * rng.standard_normal(
        (PAIRS, SUMMARIES)
    )
    with_it = exact[:PAIRS] + (other if again else noise)[:PAIRS] + effect
    paired: dict[str, FloatArray] = {name: drawn[:PAIRS] for name, drawn in values.items()}
    found = response_of(emulator, DRAG, strengths, paired, with_it, (exact + noise)[:PAIRS])
    assert found is not None
    return found


@pytest.mark.parametrize(("own", "again"), [(0.0, False), (0.5, False), (0.0, True), (0.5, True)])
def test_flags_with_an_effect_scatter_by_what_they_scatter_more(own: float, again: bool) -> None:
    # Of y = Xβ + n and y' = Xβ + Δ + n' + e: the pairs' variance is Var e, or Var e + 2 where n' is
    # another n; that of the flag with the effect exceeds that of the one without by Var e in both
    # cases.
    found = response(stream(3, "test"), own=own, again=again)
    assert found.excess == pytest.approx(own, abs=0.12)
    assert found.residual == pytest.approx(own + 2 * again, rel=0.1, abs=1e-3)


def test_the_prediction_of_an_effect_is_as_wide_as_what_scatters_and_is_left_open() -> None:
    found = response(stream(4, "test"), own=0.5, again=True)
    z = found.features(np.array([1.0]), np.array([0.15]))
    assert z.shape == (1, 3)
    assert (z @ found.coefficients)[0] == pytest.approx(np.full(SUMMARIES, 3 / DRAG.high), abs=0.5)
    assert found.inverse.shape == (3, 3)
