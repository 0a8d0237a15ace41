"""Predictions one horizon ahead, and their sensitivities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from measure.forecasting import (
    THETA,
    AcrossColumn,
    Calibration,
    EffectColumn,
    FieldColumn,
    Forecaster,
    Model,
    Segments,
    errors_of,
    library,
    observer,
    winds,
)
from measure.forecasting import model as model_module
from measure.forecasting.regressors import MotionColumn
from measure.probes import Projection, reduce_errors
from measure.propose import Term, columns_of
from measure.trajectories import Specimen, Trajectory, WindTrack
from sim.cloth import handles
from sim.integrate import JointBatch

NOMINAL = Calibration()


def test_a_recording_of_the_same_model_and_steps_is_predicted_without_error(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    errors = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    # The motion is half a metre; what is left are the solver's tolerance and the forgotten start.
    assert float(errors.norm(dim=2).max()) < 2e-4


def test_behind_a_gap_a_prediction_is_compared_from_the_third_tracked_frame_on(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    whole = Segments.of([own_recording])
    marker, gap = len(own_recording.markers) - 1, slice(whole.first + 8, whole.first + 15)
    seen = np.ones(own_recording.positions.shape[:2], dtype=bool)
    seen[gap, marker] = False
    filled = own_recording.positions.copy()
    filled[gap, marker] += 0.05
    segments = Segments.of([replace(own_recording, positions=filled, seen=seen)])
    calibrations = [NOMINAL] * len(segments)
    errors = forecaster.errors(*forecaster.system(segments, calibrations), segments)[..., 0]
    counted = segments.counted
    assert counted is not None
    np.testing.assert_array_equal(np.flatnonzero(~counted[:, marker, 0]), np.arange(8, 17))
    assert float(errors[8:17, marker].abs().max()) == 0.0
    complete = forecaster.errors(*forecaster.system(whole, calibrations), whole)[..., 0]
    # The free corner drifts off in the gap, by the velocity that it had; on its return nothing of
    # that is compared.
    assert float((errors - complete)[:8].abs().max()) < 1e-6
    assert float(errors[17:, marker].norm(dim=-1).max()) < 5e-3


def test_errors_are_observed_less_predicted(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    errors, predicted = forecaster.run(
        *forecaster.system(segments, [NOMINAL] * len(segments)), segments
    )
    observed = np.stack([s.positions[segments.first :] for s in segments.items], axis=-1)
    np.testing.assert_allclose((predicted + errors).numpy(), observed, atol=1e-12)


@pytest.mark.parametrize(
    ("effect", "parameter", "step"),
    [
        ("lift", "coefficient", 0.3),
        ("added-mass", "mass", 0.02),
        ("shear", "exponent", 0.2),
        ("finite-span-loading", "share", 0.05),
    ],
)
def test_what_a_model_lacks_returns_along_its_sensitivity(
    forecaster: Forecaster, own_recording: Trajectory, effect: str, parameter: str, step: float
) -> None:
    # Data of the base model, judged by one that has the effect: the errors are −step times the
    # sensitivity.
    segments = Segments.of([own_recording])
    column = EffectColumn(effect=effect, parameter=parameter, step=step)
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    change = forecaster.sensitivity(column, segments, [NOMINAL] * len(segments), base)
    half = Model(calibration=NOMINAL, effects=((column, step / 2),))
    judged = forecaster.errors(*half.system(forecaster, segments), segments)
    # Linear to a fifth over half the step: else the step is too large for a sensitivity.
    assert float((judged + change * step / 2).norm() / judged.norm()) < 0.2


def test_a_motion_column_is_the_observed_motion_at_the_frames_of_the_errors(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    # x = x₀ + v t + a t²/2 at every marker: by central differences v + a t one frame before each error, and a.
    period, v, a = 1 / own_recording.rate, np.array([0.3, -0.2, 0.1]), np.array([0.5, 2.0, -1.0])
    t = np.arange(len(own_recording.positions))[:, None, None] * period
    moving = replace(own_recording, positions=own_recording.positions[:1] + v * t + a * t**2 / 2)
    segments = Segments.of([moving])
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    u, w = forecaster.markers[:, 0] / 0.75, forecaster.markers[:, 1] / 0.5
    shape = (np.cos(2 * np.pi * u) * np.cos(np.pi * w))[:, None]
    for derivative in (1, 2):
        column = MotionColumn(derivative=derivative, mode=(2, 1))
        change = forecaster.sensitivity(column, segments, [NOMINAL] * len(segments), base)
        assert change.shape == base.shape
        for place, segment in enumerate(segments.items):
            before = segment.start + (segments.first - 1) * period
            expected = period**2 * shape * (v + a * before if derivative == 1 else a)
            np.testing.assert_allclose(change[0, :, :, place].numpy(), expected, atol=1e-9)


def test_a_column_across_the_motion_is_what_a_slowly_turning_frame_does(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    # Seen from a frame that turns at Ω, a point of steady velocity has the acceleration −2 Ω z × v
    # (Coriolis), and in one period moves by that times T² beyond even motion.
    period, v, turned = 1 / own_recording.rate, np.array([0.3, -0.2, 0.1]), 1e-4
    t = np.arange(len(own_recording.positions))[:, None, None] * period
    moving = replace(
        own_recording, positions=np.zeros_like(own_recording.positions[:1]) + v * (t - t.mean())
    )
    angle = -turned * t[:, 0, 0]
    cos, sin, still = np.cos(angle), np.sin(angle), np.ones_like(angle)
    turn = np.stack([[cos, -sin, 0 * still], [sin, cos, 0 * still], [0 * still, 0 * still, still]])
    there = replace(moving, positions=np.einsum("ijf,fmj->fmi", turn, moving.positions))
    beyond = there.positions[2:] - 2 * there.positions[1:-1] + there.positions[:-2]
    segments = Segments.of([there])
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    change = forecaster.sensitivity(
        AcrossColumn(mode=(0, 0)), segments, [NOMINAL] * len(segments), base
    )
    for place, segment in enumerate(segments.items):
        frame = round(segment.start / period) + segments.first - 2
        np.testing.assert_allclose(
            -2 * turned * change[0, :, :, place].numpy(), beyond[frame], rtol=1e-3, atol=1e-10
        )


def test_a_force_along_the_velocity_moves_cloth_about_as_it_moves_free_points(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    nominal = [NOMINAL] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    (drag,) = columns_of([Term(field="against_motion", shape="everywhere")])
    simulated = forecaster.sensitivity(drag, segments, nominal, base)
    written = forecaster.sensitivity(
        MotionColumn(derivative=1, mode=(0, 0)), segments, nominal, base
    )
    assert float((simulated * written).sum() / simulated.norm() / written.norm()) < -0.8
    assert 0.5 < float(simulated.norm() / written.norm()) < 1.0


def test_calibration_sensitivities_are_those_of_their_parameters(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    base = forecaster.errors(*forecaster.system(segments, [NOMINAL] * len(segments)), segments)
    changes = forecaster.sensitivities((), segments, [NOMINAL] * len(segments), base)
    assert len(changes) == len(THETA)
    heavier = Calibration(area_weight=1.05)
    errors = forecaster.errors(*forecaster.system(segments, [heavier] * len(segments)), segments)
    expected = -np.log(1.05) * changes[0]
    assert float((errors - expected).norm() / errors.norm()) < 0.2


def test_steps_in_a_joint_batch_are_those_taken_alone(
    monkeypatch: pytest.MonkeyPatch, forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    nominal = [Calibration(area_weight=1.1)] * len(segments)
    columns = (
        FieldColumn(axis=2, mode=(1, 0)),
        MotionColumn(derivative=1, mode=(0, 0)),
        FieldColumn(axis=0, mode=(0, 1)),
        *winds(),
        *library(),
    )
    # Some runs, not one: columns must not be lost between them.
    monkeypatch.setattr(observer, "WIDEST", 10 * len(segments))
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    together = forecaster.sensitivities(columns, segments, nominal, base)
    assert len(together) == len(THETA) + len(columns)
    for column, change in zip(columns, together[len(THETA) :], strict=True):
        alone = forecaster.sensitivity(column, segments, nominal, base)
        torch.testing.assert_close(change, alone, rtol=1e-9, atol=1e-12)


def test_batches_that_are_not_of_one_cloth_are_not_joined(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    segments = Segments.of([own_recording])
    system, state = forecaster.system(segments, [NOMINAL] * len(segments))
    held = replace(system, handles=replace(system.handles, stiffness=2.0))
    with pytest.raises(UsageError, match="differ in one of: handles"):
        _ = JointBatch.of([(system, state), (held, state)])[0].plain
    finer = replace(system.cloth, gradients=2 * system.cloth.gradients)
    with pytest.raises(UsageError, match="differ in mesh"):
        _ = JointBatch.of([(system, state), (replace(system, cloth=finer), state)])[0].plain
    with pytest.raises(UsageError, match="have different times"):
        JointBatch.of([(system, state), (system, replace(state, time=1.0))])


@pytest.mark.parametrize("widest", [8, 2, 1])
def test_models_in_one_batch_leave_what_they_leave_alone(
    monkeypatch: pytest.MonkeyPatch, forecaster: Forecaster, own_recording: Trajectory, widest: int
) -> None:
    """Also where the segments of one are more than a batch should have."""
    segments = Segments.of([own_recording])
    lift = EffectColumn(effect="lift", parameter="coefficient", step=0.3)
    models = [
        Model(calibration=Calibration(area_weight=area_weight), effects=((lift, strength),))
        for area_weight, strength in ((1.0, 0.0), (1.2, 0.5), (0.9, 0.8))
    ]
    monkeypatch.setattr(model_module, "WIDEST", widest * len(segments) / 4)
    together = errors_of(models, forecaster, segments)
    for model, errors in zip(models, together, strict=True):
        alone = forecaster.errors(*model.system(forecaster, segments), segments)
        torch.testing.assert_close(errors, alone, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_sensitivities_do_not_depend_on_how_many_threads_share_them_out(
    forecaster: Forecaster,
    own_recording: Trajectory,
    monkeypatch: pytest.MonkeyPatch,
    dtype: torch.dtype,
) -> None:
    segments = Segments.of([own_recording])
    calibrations = [NOMINAL] * len(segments)
    monkeypatch.setattr(observer, "_JOINT", 2 * len(segments))
    forecaster = replace(forecaster, dtype=dtype)
    base = forecaster.errors(*forecaster.system(segments, calibrations), segments)
    alone, shared = (
        replace(forecaster, workers=workers).sensitivities(
            library()[:3], segments, calibrations, base
        )
        for workers in (1, 2)
    )
    for one, two in zip(alone, shared, strict=True):
        assert torch.equal(one, two)


def test_members_of_a_batch_do_not_touch_one_another(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    twice = Segments.of([own_recording, replace(own_recording, name="again")])
    alone = Segments.of([own_recording])
    errors = forecaster.errors(
        *forecaster.system(
            twice, [NOMINAL] * len(alone) + [Calibration(area_weight=1.2)] * len(alone)
        ),
        twice,
    )
    single = forecaster.errors(*forecaster.system(alone, [NOMINAL] * len(alone)), alone)
    torch.testing.assert_close(errors[..., : len(alone)], single, rtol=0, atol=1e-9)


def test_each_segment_has_the_wind_of_its_own_time(specimen: Specimen) -> None:
    times = np.linspace(0, 10, 101)
    wind = WindTrack(times=times, velocity=np.stack([times, 0 * times, 0 * times], axis=1))
    still = np.zeros((250, specimen.mesh.vertex_count, 3))
    recording = Trajectory(
        name="ramp", markers=specimen.mesh.rest, positions=still, rate=25.0, wind=wind
    )
    segments = Segments.of([recording])
    forecaster = Forecaster(specimen=specimen, markers=specimen.mesh.rest, integrator=None)  # pyright: ignore
    system, _ = forecaster.system(segments, [NOMINAL] * len(segments))
    for place, segment in enumerate(segments.items):
        assert float(system.wind.velocity(1.0)[0, place]) == pytest.approx(
            segment.start + 1.0, abs=1e-5
        )


def test_frames_between_horizons_are_left_out(specimen: Specimen) -> None:
    still = np.zeros((300, specimen.mesh.vertex_count, 3))
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    fast = Trajectory(
        name="fast", markers=specimen.mesh.rest, positions=still, rate=60.0, wind=wind
    )
    segments = Segments.of([fast])
    assert segments.period == pytest.approx(2 / 60)
    assert segments.warm == 7


@pytest.mark.parametrize("frames", [10, 46])
def test_recordings_too_short_for_a_segment_are_refused(specimen: Specimen, frames: int) -> None:
    still = np.zeros((frames, specimen.mesh.vertex_count, 3))
    short = Trajectory(
        name="short",
        markers=specimen.mesh.rest,
        positions=still,
        rate=25.0,
        wind=WindTrack.constant((4.0, 0.0, 0.0)),
    )
    with pytest.raises(InputError, match="too short"):
        Segments.of([short])


def test_lost_markers_are_refused(own_recording: Trajectory) -> None:
    lost = own_recording.positions.copy()
    lost[3, 5] = np.nan
    with pytest.raises(InputError, match="marker was lost"):
        Segments.of([replace(own_recording, positions=lost)])


def test_sensitivities_in_single_precision_are_within_half_a_percent_of_those_in_double(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    # Of a soft and damped cloth, which bending hardly moves: simulated in single precision,
    # sensitivities to bending, to stiff hems and to rest curvature would be rounding to 1.5, 2 and
    # 22 %.
    segments = Segments.of([own_recording])
    calibrations = [Calibration(bending=0.1, damping=30e-3)] * len(segments)
    columns = (*library(), *winds())
    found: list[list[torch.Tensor]] = []
    for dtype in (torch.float32, torch.float64):
        own = replace(forecaster, dtype=dtype)
        base = own.errors(*own.system(segments, calibrations), segments)
        found.append(own.sensitivities(columns, segments, calibrations, base))
        assert all(change.dtype == dtype for change in found[-1])
    names = [name for name, *_ in THETA] + [column.name for column in columns]
    off = {
        name: float((one - two).norm() / two.norm())
        for name, one, two in zip(names, *found, strict=True)
    }
    assert {name: share for name, share in off.items() if share >= 0.005} == {}


def test_nothing_changes_with_an_effect_that_the_cloth_cannot_have(
    specimen: Specimen, forecaster: Forecaster
) -> None:
    """A hoist that is held along its length cannot be laced to the pole as well."""
    rest = specimen.mesh.rest
    held = handles.full_hoist(rest)
    anchors = np.stack(
        [0 * rest[list(held), 1], 0 * rest[list(held), 1], rest[list(held), 1]], axis=1
    )
    still = np.stack([rest[:, 0], 0.05 * np.sin(8 * rest[:, 0]), rest[:, 1]], axis=1)
    wind = WindTrack.constant((4.0, 0.0, 0.0))
    recording = Trajectory(
        name="bulging", markers=rest, positions=np.tile(still, (60, 1, 1)), rate=25.0, wind=wind
    )
    hoist = replace(forecaster, specimen=replace(specimen, held=held, anchors=anchors))
    segments = Segments.of([recording]).select([0])
    columns = [one for one in library() if one.effect in ("lift", "full-hoist", "air-density")]
    base = hoist.errors(*hoist.system(segments, [NOMINAL]), segments)
    found = hoist.sensitivities(columns, segments, [NOMINAL], base)[len(THETA) :]
    assert [one.effect for one, own in zip(columns, found, strict=True) if not own.any()] == [
        "full-hoist"
    ]
    statistics = reduce_errors(base, found, segments.recording, segments.noise)
    assert np.isfinite(statistics.r).all()
    assert np.isfinite(statistics.response).all()
    assert Projection.along(found, torch.ones(base.shape[1], 1)).directions.isfinite().all()
