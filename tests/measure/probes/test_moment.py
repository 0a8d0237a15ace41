"""The moment about the pole, against forces whose moment is known."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.core.rng import stream
from measure.forecasting import Calibration, EffectColumn, Forecaster, Segments
from measure.probes import projected_statistics
from measure.probes.statistics import PoleMoment, shares, statistics
from measure.trajectories import Trajectory

COLUMNS = (EffectColumn(effect="lift", parameter="coefficient", step=0.3),)


@pytest.fixture(scope="module")
def segments(own_recording: Trajectory) -> Segments:
    return Segments.of([own_recording])


def seen(forecaster: Forecaster, segments: Segments) -> np.ndarray:
    """(frame, marker, 3, segment) that count, from the axis [m]."""
    middle = forecaster.specimen.anchors.mean(axis=0)
    return segments.positions[segments.first :] - middle[None, None, :, None]


def moment(forecaster: Forecaster, segments: Segments, field: np.ndarray) -> np.ndarray:
    """(frame, segment) of a field, in its own units."""
    pole_moment = PoleMoment.of(torch.as_tensor(field), segments, forecaster.specimen)
    return (pole_moment.moment(torch.as_tensor(field)[None])[0] * pole_moment.scale).numpy()


def test_the_shares_are_the_cloths_area(forecaster: Forecaster, segments: Segments) -> None:
    width, height = np.ptp(forecaster.specimen.mesh.rest, axis=0)
    assert shares(forecaster.specimen, segments.markers).sum() == pytest.approx(width * height)


def test_an_angular_acceleration_has_the_moment_of_inertias(
    forecaster: Forecaster, segments: Segments
) -> None:
    """α ẑ × r has the moment α Σ w (x² + y²), whatever else pushes along the axis or toward it."""
    r = seen(forecaster, segments)
    turned = np.stack([-r[:, :, 1], r[:, :, 0], 0 * r[:, :, 2]], axis=2)
    beside = np.stack([0.7 * r[:, :, 0], 0.7 * r[:, :, 1], np.ones_like(r[:, :, 2])], axis=2)
    share = shares(forecaster.specimen, segments.markers)
    inertia = np.einsum("m,fms->fs", share, r[:, :, 0] ** 2 + r[:, :, 1] ** 2)
    found = moment(forecaster, segments, 0.3 * turned * segments.period**2 + beside)
    np.testing.assert_allclose(found, 0.3 * inertia, rtol=1e-6, atol=1e-9)


def test_forces_between_two_points_have_none(forecaster: Forecaster, segments: Segments) -> None:
    r, share = seen(forecaster, segments), shares(forecaster.specimen, segments.markers)
    one, other = stream(1, "pair").choice(
        np.flatnonzero(share > 0.5 * share.mean()), 2, replace=False
    )
    along = r[:, other] - r[:, one]
    field = np.zeros_like(r)
    field[:, one], field[:, other] = along / share[one], -along / share[other]
    alone = field.copy()
    alone[:, other] = 0.0
    pair, single = (np.abs(moment(forecaster, segments, f)).max() for f in (field, alone))
    assert pair < 1e-9 * single


def test_kept_directions_say_of_the_base_models_moment_what_the_statistics_say(
    forecaster: Forecaster, segments: Segments
) -> None:
    nominal = [Calibration(area_weight=1.1)] * len(segments)
    found, projection = projected_statistics(forecaster, segments, nominal, COLUMNS)
    errors = forecaster.errors(*forecaster.system(segments, nominal), segments)
    turned, kept = found.turning, projection.turned(errors)
    assert turned is not None
    assert kept is not None
    np.testing.assert_allclose(kept, turned.r, rtol=1e-6, atol=1e-9)
    alone = statistics(forecaster, segments, nominal, COLUMNS).turning
    assert alone is not None
    np.testing.assert_array_equal(alone.response, turned.response)
    moved = forecaster.sensitivity(COLUMNS[0], segments, nominal, errors)
    response = projection.turned(moved)
    assert response is not None
    np.testing.assert_allclose(response, turned.response[:, :, 3], rtol=1e-5, atol=1e-8)
