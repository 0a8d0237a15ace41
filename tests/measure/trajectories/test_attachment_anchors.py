"""Anchors taken from recordings: the mean place of each attachment, and only where they are not
given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.trajectories import Specimen, Trajectory, WindTrack, as_seen
from measure.trajectories.attachment_anchors import anchors_of

PULL = np.array([2e-3, 0.0, -1e-3])


def flat(specimen: Specimen, name: str, moved: np.ndarray, frames: int) -> Trajectory:
    """The flag upright in the plane, displaced and swinging about it by 1 cm across the wind."""
    rest = specimen.mesh.rest
    place = np.stack([rest[:, 0], 0 * rest[:, 0], rest[:, 1]], axis=1) + moved
    swing = 0.01 * np.sin(2 * np.pi * np.arange(frames) / frames)
    positions = place + swing[:, None, None] * np.array([0.0, 1.0, 0.0])
    return Trajectory(
        name=name,
        markers=rest,
        positions=positions,
        rate=25.0,
        wind=WindTrack.constant((4.0, 0.0, 0.0)),
    )


def test_recordings_count_alike_whatever_their_length(specimen: Specimen) -> None:
    recordings = [flat(specimen, "a", np.zeros(3), 20), flat(specimen, "b", PULL, 60)]
    seats = specimen.mesh.rest[list(specimen.held)]
    expected = np.stack([seats[:, 0], 0 * seats[:, 0], seats[:, 1]], axis=1) + PULL / 2
    np.testing.assert_allclose(anchors_of(recordings, seats), expected, atol=1e-12)


def test_what_was_filled_in_does_not_move_an_anchor(specimen: Specimen) -> None:
    whole = flat(specimen, "a", np.zeros(3), 40)
    corner = specimen.held[0]
    seen = np.ones(whole.positions.shape[:2], dtype=bool)
    seen[:20, corner] = False
    # A swing of 40 frames: over the last half, in which the corner was tracked, it is −2/π cm on
    # the average.
    filled = whole.positions.copy()
    filled[:20, corner] += 0.08
    seats = specimen.mesh.rest[list(specimen.held)]
    found = anchors_of([replace(whole, positions=filled, seen=seen)], seats)
    plain = anchors_of([whole], seats)
    np.testing.assert_allclose(
        found - plain,
        [[0.0, whole.positions[20:, corner, 1].mean(), 0.0], [0.0, 0.0, 0.0]],
        atol=1e-12,
    )


@pytest.mark.parametrize("given", [True, False])
def test_given_anchors_stay(specimen: Specimen, given: bool) -> None:
    known = replace(specimen, anchors_given=given)
    found = as_seen(known, [flat(specimen, "a", PULL, 20)])
    np.testing.assert_allclose(
        found.anchors - specimen.anchors, np.zeros((2, 3)) + (0 if given else PULL), atol=1e-12
    )
