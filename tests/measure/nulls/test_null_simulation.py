"""Null recordings of cloth that is stretched beyond what a stable step is estimated for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from measure.forecasting import Calibration
from measure.nulls import NullBatch, StiffnessFactors
from measure.trajectories import AttachmentTrack, Specimen, WindTrack
from sim.cloth import handles
from sim.effects import VerticalWind
from sim.run.simulation_loop import DivergedError


def batch(specimen: Specimen, *, speed: float) -> NullBatch:
    """One gently damped flag of little stretching stiffness, by explicit steps."""
    return NullBatch(
        specimen=specimen,
        markers=specimen.mesh.rest,
        rate=25.0,
        duration=0.4,
        noise=0.0,
        seed=5,
        calibrations=(Calibration(damping=0.5e-3),),
        speeds=(speed,),
        stiffness=StiffnessFactors(stretching=0.02),
    )


def usual(nulls: NullBatch) -> np.ndarray:
    """Positions by the first attempt, in steps that are not halved."""
    return nulls._run(*nulls._mesh(), *nulls._method(0))


def test_a_run_that_diverges_is_run_anew_in_smaller_steps(specimen: Specimen) -> None:
    stretched = batch(specimen, speed=1e3)
    with pytest.raises(DivergedError):
        usual(stretched)
    (recording,) = stretched.simulate()
    assert np.isfinite(recording.positions).all()


def test_a_run_that_does_not_diverge_keeps_its_steps(specimen: Specimen) -> None:
    calm = batch(specimen, speed=9.0)
    np.testing.assert_array_equal(calm._frames(*calm._mesh()), usual(calm))


def test_a_cloth_that_no_step_holds_is_refused_with_its_numbers(specimen: Specimen) -> None:
    with pytest.raises(
        FlagdataError, match=r"1e\+05 m/s: .* even in steps 8 times smaller.*check the unit"
    ):
        batch(specimen, speed=1e5).simulate()


def test_a_wind_that_blows_is_the_steady_one_where_it_does_not_vary(specimen: Specimen) -> None:
    """A logged wind without variation gives the recording of the steady one; a wind that falls to
    nothing half a second before the first frame, another, and it is what stands beside the
    recording."""
    calm = batch(specimen, speed=9.0)
    level = WindTrack(times=np.array([-4.0, 1.0]), velocity=np.full((2, 3), [9.0, 0.0, 0.0]))
    falls = WindTrack(
        times=np.array([-4.0, -0.6, -0.5]), velocity=np.outer([9.0, 9.0, 0.0], [1.0, 0.0, 0.0])
    )
    (steady,), (same,), (other,) = (
        made.simulate() for made in (calm, _in(calm, level), _in(calm, falls))
    )
    np.testing.assert_allclose(same.positions, steady.positions, rtol=0, atol=1e-6)
    assert np.abs(other.positions[0] - steady.positions[0]).max() > 1e-3
    assert other.wind is falls


def test_an_effect_on_the_wind_acts_on_one_that_blows(specimen: Specimen) -> None:
    """A wind that rises blows up a logged wind without variation as it does the steady one."""
    rising = replace(batch(specimen, speed=9.0), effects=(VerticalWind(inclination=0.3),))
    level = WindTrack(times=np.array([-4.0, 1.0]), velocity=np.full((2, 3), [9.0, 0.0, 0.0]))
    (steady,), (same,) = rising.simulate(), _in(rising, level).simulate()
    (without,) = _in(replace(rising, effects=()), level).simulate()
    np.testing.assert_allclose(same.positions, steady.positions, rtol=0, atol=1e-5)
    assert np.abs(without.positions - same.positions).max() > 1e-2


def test_a_carried_null_is_held_where_its_way_goes_at_every_frame(specimen: Specimen) -> None:
    """Two upper corners on ways of their own, one to and fro and one up and down, turned by 40°
    from the x axis."""
    held = handles.top_corners(specimen.mesh.rest)
    turned = specimen.mesh.rest[list(held), 0, None] * [math.cos(0.7), math.sin(0.7), 0.0] + [
        0.0,
        0.0,
        2.0,
    ]
    times = np.arange(-4.0, 3.0, 0.01)
    moved = np.zeros((len(times), 2, 3))
    moved[:, :, 1] = 0.1 * np.sin(4 * times)[:, None]
    moved[:, 1, 2] = 0.02 * np.sin(7 * times)
    way = AttachmentTrack(times=times, places=turned + moved)
    nulls = replace(
        batch(specimen, speed=0.0),
        specimen=replace(specimen, held=held, anchors=turned, stiffness=math.inf),
        stiffness=StiffnessFactors(),
        tracks=(way,),
        duration=1.0,
    )
    (recording,) = nulls.simulate()
    assert recording.attachments is not None
    # At up to 0.4 m/s, half a millisecond of an explicit step is 0.2 mm; a frame of 40 ms would be
    # 16 mm.
    np.testing.assert_allclose(recording.attachments, way.at(recording.times), rtol=0, atol=4e-4)
    assert np.ptp(recording.positions[:, :, 1]) > 0.1


def _in(nulls: NullBatch, wind: WindTrack) -> NullBatch:
    return replace(nulls, winds=(wind,))
