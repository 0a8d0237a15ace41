"""The cloth in motion: what the player gets is what was observed and predicted."""

from __future__ import annotations

import base64
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from measure.report.moving_cloth import ELEVATION, FACTORS, MISSING, motion, pack_clip, still
from measure.verdict import Residual
from tests.measure.report.verdicts import FULL, Size, residual

STEPS = 32767


def recording(size: Size = FULL) -> Residual:
    return residual("one", 5.0, held_out=True, with_after=True, seed=1, size_of=size)


def unpacked(text: str, shape: tuple[int, int, int]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<i2").reshape(shape)


def test_the_packed_positions_and_errors_are_the_given_ones_to_one_step() -> None:
    given = recording()
    moved = motion(given)
    assert moved is not None
    data = pack_clip(moved)
    shape = (moved.frames, moved.markers, 3)
    observed = np.asarray(given.observed)
    seen = unpacked(data["observed"], shape) / STEPS * data["size"]
    about = observed - observed.reshape(-1, 3).mean(axis=0)
    assert np.abs(seen - about).max() <= data["size"] / STEPS
    for packed, predicted in zip(data["errors"], (given.before, given.after), strict=True):
        errors = unpacked(packed, shape) / STEPS * data["reach"]
        assert np.abs(errors - (np.asarray(predicted) - observed)).max() <= data["reach"] / STEPS
    assert data["reach"] / STEPS < 1e-6  # a micrometre, where errors are millimetres


def test_a_lost_marker_is_marked_and_not_moved_to_the_middle() -> None:
    given = recording()
    frames = [[[math.nan] * 3, *frame[1:]] for frame in given.observed]
    moved = motion(replace(given, observed=frames))
    assert moved is not None
    packed = unpacked(pack_clip(moved)["observed"], (moved.frames, moved.markers, 3))
    assert (packed[:, 0] == MISSING).all()
    assert (packed[:, 1:] != MISSING).all()


def test_large_recordings_are_thinned_evenly_and_say_so() -> None:
    moved = motion(recording(Size(across=40, up=25, frames=200, stretch=150)))
    assert moved is not None
    assert (moved.of_frames, moved.of_markers) == (150, 1000)
    assert moved.frames <= 60
    assert moved.markers <= 260


def test_a_rectangular_grid_is_joined_to_its_neighbours_only() -> None:
    """n × m points: n(m−1) + m(n−1) sides and (n−1)(m−1) diagonals, by Euler's formula."""
    size = Size(across=7, up=5)
    moved = motion(recording(size))
    assert moved is not None
    across, up = size.across, size.up
    assert len(moved.edges) == across * (up - 1) + up * (across - 1) + (across - 1) * (up - 1)
    longest = math.hypot(1.2 / (across - 1), 0.8 / (up - 1))
    uv = np.asarray(recording(size).markers)
    lengths = np.linalg.norm(uv[moved.edges[:, 0]] - uv[moved.edges[:, 1]], axis=1)
    assert lengths.max() == pytest.approx(longest)


def test_markers_on_a_line_are_joined_in_their_order() -> None:
    moved = motion(recording(Size(across=6, up=1)))
    assert moved is not None
    assert moved.edges.tolist() == [[n, n + 1] for n in range(5)]


def test_errors_are_enlarged_to_be_seen_and_no_further() -> None:
    given = recording()
    observed = np.asarray(given.observed)
    shift = np.array([0.0, 0.002, 0.0])
    moved = motion(replace(given, before=(observed + shift).tolist(), after=[]))
    assert moved is not None
    size = 2 * np.abs(observed - observed.reshape(-1, 3).mean(axis=0)).max()
    assert moved.factor in FACTORS
    assert 0.03 * size < moved.factor * 0.002 <= 0.12 * size
    assert moved.after is None


def test_no_stretch_or_no_times_is_no_motion() -> None:
    given = recording(Size())
    assert motion(replace(given, observed=[], before=[], after=[])) is None
    assert motion(replace(given, times=[0.0])) is None


def test_the_first_frame_is_projected_from_the_side_and_a_little_above() -> None:
    """Two markers one above the other project at the same place across, z cos(elevation) apart."""
    given = residual(
        "one", 5.0, held_out=True, with_after=False, seed=1, size_of=Size(across=1, up=2)
    )
    pole = [[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]] * 2
    moved = motion(replace(given, observed=pole, before=pole, markers=[[0.0, 0.0], [0.0, 1.0]]))
    assert moved is not None
    path = re.search(
        r'class="mesh observed" d="M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)"', str(still(moved, ""))
    )
    assert path
    left, low, right, high = map(float, path.groups())
    assert left == right
    scale = 150 * 0.86 / moved.radius
    assert low - high == pytest.approx(scale * math.cos(ELEVATION), abs=0.2)  # written to a tenth
