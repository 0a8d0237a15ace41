"""Fits find what was planted, and errors count as stated."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.errors import UsageError
from tests.studies.validation.paper_flag.candidates import Candidate, Load, Shear, loaded, tried
from tests.studies.validation.paper_flag.evidence import (
    NEVER,
    Condition,
    Interval,
    Kind,
    LinearTable,
    errors,
    fit,
    paired,
)
from tests.studies.validation.paper_flag.sheet import Sheet, leading, onset

BARE = Sheet(length=0.1385, mass=0.08, rigidity=1.315e-4)
LENGTHS = (0.08, 0.12)


def planted(load: Load, factor: float) -> list[Condition]:
    """What a sheet with this load shows at `factor` times the tunnel's speed."""
    sheet = loaded(load, bare=BARE, length=BARE.length, density=1.1)
    found = [
        Condition(kind=Kind.FREQUENCY, at=u, value=leading(sheet, factor * u).frequency)
        for u in (7.0, 8.0, 9.0, 10.0)
    ]
    for length in LENGTHS:
        shorter = loaded(load, bare=BARE, length=length, density=1.1)
        found.append(
            Condition(kind=Kind.STOP, at=length, value=onset(shorter, highest=30.0) / factor)
        )
    return found


def test_a_planted_load_and_factor_are_found() -> None:
    truth = tried(Candidate.REACTIVE)[16]
    table = LinearTable(tried(Candidate.REACTIVE)[12:21], bare=BARE, density=1.1, lengths=LENGTHS)
    found = fit(table, Shear.FREE, planted(truth, 0.6))
    assert table.loads[found.load] == truth
    assert found.factor == pytest.approx(0.6, rel=0.015)  # factors are 2 % apart
    # By linear interpolation of frequencies between speeds 0.1 m/s apart, and half a step of the
    # factors.
    assert found.loss < 1e-3


def test_a_model_without_flutter_is_wrong_by_a_factor_of_ten() -> None:
    table = LinearTable(tried(Candidate.NONE), bare=BARE, density=1.1, lengths=LENGTHS)
    conditions = planted(Load(reactive=0.3), 0.6)
    assert errors(table, 0, 0.6, conditions) == pytest.approx([NEVER] * len(conditions))
    assert math.exp(NEVER) == pytest.approx(10)


def test_a_length_that_was_not_named_and_a_kind_without_prediction_are_refused() -> None:
    table = LinearTable((Load(reactive=0.3),), bare=BARE, density=1.1, lengths=LENGTHS)
    with pytest.raises(UsageError, match="name the length"):
        table.predict(0, np.ones(1), Condition(kind=Kind.STOP, at=0.2, value=5.0))
    with pytest.raises(UsageError, match="simulate"):
        table.predict(0, np.ones(1), Condition(kind=Kind.WAVE, at=8.0, value=5.0))


def test_gains_are_paired_by_condition() -> None:
    # |before| − |after| = 0.1, 0.3: mean 0.2, standard error 0.1, Student's t(0.95, 1) = 6.3138.
    gain = paired(np.array([0.2, -0.5]), np.array([-0.1, 0.2]))
    assert (gain.mean, gain.low, gain.high) == pytest.approx(
        (0.2, 0.2 - 0.63138, 0.2 + 0.63138), rel=1e-4
    )
    assert Interval.of(np.array([0.3])).as_dict() == {
        "mean": 0.3,
        "low": None,
        "high": None,
        "count": 1,
    }


def test_the_logged_speed_is_not_fitted() -> None:
    table = LinearTable((Load(reactive=0.3),), bare=BARE, density=1.1, lengths=LENGTHS)
    assert fit(table, Shear.LOGGED, planted(Load(reactive=0.3), 0.6)).factor == 1.0
