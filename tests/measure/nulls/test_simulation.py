"""Null recordings of cloth that is stretched beyond what a stable step is estimated for."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from measure.forecasting.calibration import Calibration
from measure.nulls.simulation import NullBatch
from measure.observe.trajectory import Specimen


def batch(specimen: Specimen, *, speed: float) -> NullBatch:
    """One gently damped flag of little stretching stiffness, by explicit steps."""
    return NullBatch(
        specimen=specimen, markers=specimen.mesh.rest, rate=25.0, duration=0.4, noise=0.0, seed=5,
        calibrations=(Calibration(damping=0.5e-3),), speeds=(speed,), stretching=0.02,
    )  # fmt: skip


def usual(nulls: NullBatch) -> np.ndarray:
    """Positions by the first attempt, in steps that are not halved."""
    return nulls._run(*nulls._mesh(), 0)


def test_a_run_that_diverges_is_run_anew_in_smaller_steps(specimen: Specimen) -> None:
    stretched = batch(specimen, speed=1e3)
    assert not np.isfinite(usual(stretched)).all()
    (recording,) = stretched.simulate()
    assert np.isfinite(recording.positions).all()


def test_a_run_that_does_not_diverge_keeps_its_steps(specimen: Specimen) -> None:
    calm = batch(specimen, speed=9.0)
    np.testing.assert_array_equal(calm._frames(*calm._mesh()), usual(calm))


def test_a_cloth_that_no_step_holds_is_refused_with_its_numbers(specimen: Specimen) -> None:
    with pytest.raises(FlagdataError, match=r"1e\+05 m/s: .* even in steps 8 times smaller.*check the unit"):
        batch(specimen, speed=1e5).simulate()
