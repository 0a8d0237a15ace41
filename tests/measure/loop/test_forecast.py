"""Predictions one horizon ahead, and their sensitivities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from measure.loop.columns import THETA, Calibration, EffectColumn
from measure.loop.forecast import Forecaster, Segments
from measure.loop.model import Model
from measure.observe.trajectory import Specimen, Trajectory, WindTrack

NOMINAL = Calibration()


def test_a_recording_of_the_same_model_and_steps_is_predicted_without_error(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    errors = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    # The motion is half a metre; what is left are the solver's tolerance and the forgotten start.
    assert float(errors.norm(dim=2).max()) < 2e-4


def test_errors_are_observed_less_predicted(forecaster: Forecaster, own_recording: Trajectory) -> None:
    segments = Segments.of([own_recording])
    errors, predicted = forecaster.run(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    observed = np.stack([s.positions[segments.first :] for s in segments.items], axis=-1)
    np.testing.assert_allclose((predicted + errors).numpy(), observed, atol=1e-12)


@pytest.mark.parametrize(
    ("effect", "parameter", "step"),
    [("lift", "coefficient", 0.3), ("added-mass", "mass", 0.02), ("shear", "exponent", 0.2)],
)
def test_what_a_model_lacks_returns_along_its_sensitivity(
    forecaster: Forecaster, own_recording: Trajectory, effect: str, parameter: str, step: float
) -> None:
    # Data of the base model, judged by one that has the effect: the errors are −step times the sensitivity.
    segments = Segments.of([own_recording])
    column = EffectColumn(effect=effect, parameter=parameter, step=step)
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    change = forecaster.sensitivity(column, segments, [NOMINAL] * len(segments), base)
    half = Model(calibration=NOMINAL, effects=((column, step / 2),))
    judged = forecaster.errors(*half.system(forecaster, segments), segments)
    # Linear to a fifth over half the step: else the step is too large for a sensitivity.
    assert float((judged + change * step / 2).norm() / judged.norm()) < 0.2


def test_calibration_sensitivities_are_those_of_their_parameters(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    changes = forecaster.calibration_sensitivities(segments, [NOMINAL] * len(segments), base)
    assert len(changes) == len(THETA)
    heavier = Calibration(density=1.05)
    errors = forecaster.errors(*forecaster.system(segments, [heavier] * len(segments)), segments)
    expected = -np.log(1.05) * changes[0]
    assert float((errors - expected).norm() / errors.norm()) < 0.2


def test_members_of_a_batch_do_not_touch_one_another(forecaster: Forecaster, own_recording: Trajectory) -> None:
    twice = Segments.of([own_recording, replace(own_recording, name="again")])
    alone = Segments.of([own_recording])
    errors = forecaster.errors(
        *forecaster.system(twice, [NOMINAL] * len(alone) + [Calibration(density=1.2)] * len(alone)), twice
    )
    single = forecaster.errors(*forecaster.system(alone, [NOMINAL] * len(alone)), alone)
    torch.testing.assert_close(errors[..., : len(alone)], single, rtol=0, atol=1e-9)


def test_each_segment_has_the_wind_of_its_own_time(specimen: Specimen) -> None:
    times = np.linspace(0, 10, 101)
    wind = WindTrack(times=times, velocity=np.stack([times, 0 * times, 0 * times], axis=1))
    still = np.zeros((250, specimen.mesh.vertex_count, 3))
    recording = Trajectory(name="ramp", markers=specimen.mesh.rest, positions=still, rate=25.0, wind=wind)
    segments = Segments.of([recording])
    forecaster = Forecaster(specimen=specimen, markers=specimen.mesh.rest, integrator=None)  # pyright: ignore
    system, _ = forecaster.system(segments, [NOMINAL] * len(segments))
    for place, segment in enumerate(segments.items):
        assert float(system.wind.velocity(1.0)[0, place]) == pytest.approx(segment.start + 1.0, abs=1e-5)


def test_frames_between_horizons_are_left_out(specimen: Specimen) -> None:
    still = np.zeros((300, specimen.mesh.vertex_count, 3))
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    fast = Trajectory(name="fast", markers=specimen.mesh.rest, positions=still, rate=60.0, wind=wind)
    segments = Segments.of([fast])
    assert segments.period == pytest.approx(2 / 60)
    assert segments.warm == 7


@pytest.mark.parametrize("frames", [10, 46])
def test_recordings_too_short_for_a_segment_are_refused(specimen: Specimen, frames: int) -> None:
    still = np.zeros((frames, specimen.mesh.vertex_count, 3))
    short = Trajectory(
        name="short", markers=specimen.mesh.rest, positions=still, rate=25.0, wind=WindTrack.constant((4.0, 0.0, 0.0))
    )
    with pytest.raises(InputError, match="too short"):
        Segments.of([short])


def test_lost_markers_are_refused(own_recording: Trajectory) -> None:
    lost = own_recording.positions.copy()
    lost[3, 5] = np.nan
    with pytest.raises(InputError, match="marker was lost"):
        Segments.of([replace(own_recording, positions=lost)])
