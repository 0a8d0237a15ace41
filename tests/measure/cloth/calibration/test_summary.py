"""From windows to summaries."""

from __future__ import annotations

import numpy as np

from measure.cloth import Projection
from measure.cloth.observed_recording import shown


def test_a_line_in_the_logarithm_of_the_wind_is_found_exactly_with_windows_missing() -> None:
    speed = np.linspace(3.0, 8.0, 20)
    relative = np.log(speed / np.exp(np.log(speed).mean()))
    readings = np.stack([0.4 - 0.7 * relative, 1.5 + 0.2 * relative], axis=1)
    readings[3:8, 0] = np.nan
    found = Projection(speed=speed, changes=True).of(readings[None])
    assert np.allclose(found[0], [[0.4, 1.5], [-0.7, 0.2]])
    assert np.allclose(
        Projection(speed=speed, changes=True).at(found)[0, 3],
        [0.4 - 0.7 * relative[3], readings[3, 1]],
    )


def test_what_too_few_windows_show_is_left_out() -> None:
    readings = np.ones((20, 2))
    readings[:9, 1] = np.nan
    assert shown(readings).tolist() == [True, False]
    found = Projection(speed=np.full(20, 5.0), changes=False).of(readings)
    assert found.shape == (1, 2)
    assert found[0, 0] == 1.0
    assert np.isnan(found[0, 1])
