"""Directions that are kept say of other errors what the statistics say of the base model's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import UsageError
from measure.forecasting import AcrossColumn, Calibration, EffectColumn, Forecaster, Segments
from measure.probes import Statistics, projected_statistics
from measure.probes.statistics import statistics
from measure.trajectories import Trajectory

COLUMNS = (
    EffectColumn(effect="lift", parameter="coefficient", step=0.3),
    EffectColumn(effect="added-mass", parameter="mass", step=0.05),
)


@pytest.fixture(scope="module")
def segments(own_recording: Trajectory) -> Segments:
    return Segments.of([own_recording])


def test_the_projection_of_the_base_models_errors_is_r(
    forecaster: Forecaster, segments: Segments
) -> None:
    nominal = [Calibration(area_weight=1.1)] * len(segments)
    found, projection = projected_statistics(forecaster, segments, nominal, COLUMNS)
    errors = forecaster.errors(*forecaster.system(segments, nominal), segments)
    np.testing.assert_allclose(projection.of(errors), found.r, rtol=1e-9, atol=1e-12)
    alone = statistics(forecaster, segments, nominal, COLUMNS)
    np.testing.assert_array_equal(alone.r, found.r)
    np.testing.assert_array_equal(alone.response, found.response)
    np.testing.assert_array_equal(alone.lines, found.lines)
    again = projection.lines(errors)
    assert again is not None
    assert found.lines is not None
    np.testing.assert_allclose(again, found.lines, rtol=1e-6)
    whole = Statistics.joined(
        [alone.select(np.array([0])), alone.select(np.arange(1, len(segments)))]
    )
    np.testing.assert_array_equal(whole.lines, found.lines)
    with pytest.raises(UsageError, match="only some parts have lines"):
        Statistics.joined([alone, replace(alone, lines=None)])


def test_errors_along_a_sensitivity_project_as_its_response(
    forecaster: Forecaster, segments: Segments
) -> None:
    nominal = [Calibration()] * len(segments)
    found, projection = projected_statistics(forecaster, segments, nominal, COLUMNS)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    column = 4
    moved = forecaster.sensitivity(COLUMNS[1], segments, nominal, base)
    # So small a coefficient that no error is clipped.
    small = 1e-3 * projection.scale.min() / moved.abs().max()
    expected = float(small) * found.response[:, :, column]
    np.testing.assert_allclose(projection.of(small * moved), expected, rtol=1e-9, atol=1e-12)
    response = projection.response([moved, 2 * moved])
    np.testing.assert_allclose(
        response[:, :, 0], found.response[:, :, column], rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(
        response[:, :, 1], 2 * found.response[:, :, column], rtol=1e-9, atol=1e-12
    )


def test_mirrored_across_the_wind_only_what_pushes_across_the_motion_changes_its_sign(
    forecaster: Forecaster, own_recording: Trajectory
) -> None:
    # Base model, lift and added mass do not know left from right: cloth mirrored in the plane of
    # wind and gravity moves as the mirror image, but for its small bending, which by ArcSim's
    # tables knows the faces.
    columns = (*COLUMNS, AcrossColumn(mode=(0, 0)))
    mirrored = replace(own_recording, positions=own_recording.positions * [1.0, -1.0, 1.0])
    found, image = (
        statistics(forecaster, own, [Calibration(area_weight=1.1)] * len(own), columns)
        for own in (Segments.of([own_recording]), Segments.of([mirrored]))
    )
    alike, signs = [0, 2, 3, 4, 5], np.array([1.0, 1.0, 1.0, 1.0, -1.0])
    turning, turned = found.turning, image.turning
    assert turning is not None
    assert turned is not None
    for own, other in ((found.r, image.r), (turning.r, turned.r)):
        close = 0.005 * np.abs(own).max()
        assert np.abs(own[:, -1]).min() > 5 * close
        np.testing.assert_allclose(other[:, alike], signs * own[:, alike], atol=close)


def test_what_is_not_along_any_direction_does_not_count(
    forecaster: Forecaster, segments: Segments
) -> None:
    found, projection = projected_statistics(
        forecaster, segments, [Calibration()] * len(segments), COLUMNS
    )
    shape = (-1, *projection.scale.shape[:1], 3)
    directions = projection.directions[0]
    noise = torch.randn(
        directions.shape[1], dtype=directions.dtype, generator=torch.Generator().manual_seed(1)
    )
    span, _ = torch.linalg.qr(directions.T)
    orthogonal = (noise - span @ (span.T @ noise)).reshape(shape) * projection.scale[
        None, :, 0, None
    ]
    errors = torch.stack([0.1 * orthogonal] * len(segments), dim=-1)
    assert np.abs(projection.of(errors)[0]).max() < 1e-9 * np.abs(found.r).max() + 1e-9
