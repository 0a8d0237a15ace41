"""Errors weighed by what is usual of smooth shapes, held against the covariance written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from flagdata.rng import stream
from measure.loop.forecast import Segments
from measure.loop.weights import Usual, Weights, fields
from measure.observe.trajectory import Trajectory, WindTrack
from sim.mesh import grid

CLOTH = grid(width=1.5, height=1.0, columns=9, rows=6).rest
MARKERS = CLOTH[stream(3, "markers").permutation(len(CLOTH))[:40]]


@pytest.fixture(scope="module")
def segments() -> Segments:
    still = np.zeros((130, len(MARKERS), 3))
    wind = WindTrack.constant((5.0, 0.0, 0.0))
    return Segments.of(
        [Trajectory(name=n, markers=MARKERS, positions=still, rate=25.0, wind=wind, noise=0.0) for n in "ab"]
    )


@pytest.fixture(scope="module")
def errors(segments: Segments) -> torch.Tensor:
    """Mostly one smooth shape, larger in the second recording."""
    rng = stream(4, "errors")
    frames, bend = 50, np.cos(np.pi * MARKERS[:, 0] / 1.5)
    course = rng.standard_normal((frames, 1, 3, len(segments)))
    made = 5e-3 * rng.standard_normal((frames, len(MARKERS), 3, len(segments))) + 0.02 * bend[:, None, None] * course
    return torch.as_tensor(made * np.where(segments.recording == 1, 3.0, 1.0))


@pytest.fixture(scope="module")
def usual(segments: Segments, errors: torch.Tensor) -> Usual:
    return Usual.of(errors, segments, CLOTH)


def test_what_is_usual_is_the_covariance_of_the_fitted_amplitudes(
    segments: Segments, errors: torch.Tensor, usual: Usual
) -> None:
    shapes = fields(usual.shapes, MARKERS, CLOTH).numpy()
    weights = Weights.of(errors, segments, CLOTH)
    whole = np.concatenate([weights.errors(errors[..., k], k).reshape(50, -1, 3).numpy() for k in range(len(segments))])
    amplitudes = np.stack([np.linalg.lstsq(shapes, frame, rcond=None)[0] for frame in whole])
    flat = amplitudes.reshape(len(whole), -1)
    np.testing.assert_allclose(usual.covariance, flat.T @ flat / len(flat), rtol=1e-9, atol=1e-12)
    left = whole - np.einsum("mk,fkx->fmx", shapes, amplitudes)
    assert usual.rest == pytest.approx((left**2).sum() / (left.size * (1 - shapes.shape[1] / len(MARKERS))))


def test_the_inner_product_is_that_of_the_covariance_in_space(
    segments: Segments, errors: torch.Tensor, usual: Usual
) -> None:
    """⟨x, y⟩ = xᵀ K⁻¹ y with K = Φ C Φᵀ + v (1 − Φ Φ⁺), a frame."""
    weights = Weights.of(errors, segments, CLOTH, usual)
    basis = np.kron(fields(usual.shapes, MARKERS, CLOTH).numpy(), np.eye(3))
    whole = basis @ np.linalg.inv(usual.inverse) @ basis.T
    whole += usual.rest * (np.eye(len(basis)) - basis @ np.linalg.pinv(basis))
    field = stream(5, "field").standard_normal((2, 7, len(MARKERS), 3))
    expected = np.linalg.solve(whole, field.reshape(14, -1).T).T.reshape(2, -1)
    found = weights.weighed(torch.as_tensor(field).flatten(1)).numpy()
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * np.abs(expected).max())


def test_what_errors_are_usually_shaped_like_counts_little(
    segments: Segments, errors: torch.Tensor, usual: Usual
) -> None:
    weights = Weights.of(errors, segments, CLOTH, usual)
    usually = np.cos(np.pi * MARKERS[:, 0] / 1.5)
    other = np.cos(2 * np.pi * MARKERS[:, 1])
    sizes = []
    for shape in (usually, other):
        field = torch.as_tensor(np.repeat(shape[:, None], 3, axis=1).reshape(1, -1))
        sizes.append(float((weights.weighed(field) * field).sum() / (field**2).sum()))
    assert sizes[0] < 0.1 * sizes[1]


def test_an_effect_does_not_weigh_itself_down(segments: Segments, errors: torch.Tensor, usual: Usual) -> None:
    """Errors ten times as large are weighed as they were: only their scale is the recording's own."""
    field = torch.as_tensor(stream(6, "field").standard_normal((1, 3 * len(MARKERS))))
    one, ten = (Weights.of(size * errors, segments, CLOTH, usual) for size in (1.0, 10.0))
    torch.testing.assert_close(one.weighed(field), ten.weighed(field))
    torch.testing.assert_close(10 * one.scale, ten.scale)
    parts = [np.flatnonzero(segments.recording == r) for r in (0, 1)]
    joined = Weights.joined([Weights.of(errors[..., p], segments.select(p.tolist()), CLOTH, usual) for p in parts])
    torch.testing.assert_close(joined.scale, one.scale)


def test_without_nulls_all_shapes_count_alike(segments: Segments, errors: torch.Tensor) -> None:
    field = torch.as_tensor(stream(6, "field").standard_normal((1, 3 * len(MARKERS))))
    torch.testing.assert_close(Weights.of(errors, segments, CLOTH).weighed(field), field)


def test_nulls_of_other_markers_are_refused(segments: Segments, errors: torch.Tensor, usual: Usual) -> None:
    few = replace(segments, markers=MARKERS[:5])
    with pytest.raises(InputError, match="5 markers for"):
        Weights.of(errors[:, :5], few, CLOTH, usual)
    with pytest.raises(InputError, match="different numbers"):
        Usual.pooled([usual, Usual.of(errors[:, :5], few, CLOTH)])
    pooled = Usual.pooled([usual, usual])
    np.testing.assert_allclose(pooled.covariance, usual.covariance)
