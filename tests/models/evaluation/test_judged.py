"""Which targets a network is judged by: those that every clip states."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.errors import InputError
from models.evaluation.predict import judged_targets
from models.trained import estimator

STATED = {"wind_speed": np.array([2.0, 3.0]), "area_weight": np.array([0.1, 0.2])}
SIZED = {"width": np.array([1.5, 1.5]), "height": np.array([1.0, np.nan])}


def test_a_target_that_not_every_clip_states_is_left_out() -> None:
    shipped = estimator.load_shipped("flow-outdoor")
    assert judged_targets(shipped, STATED | SIZED) == ("outdoor_wind", "fabric_area_weight")
    assert (
        judged_targets(shipped, STATED | SIZED | {"height": np.array([1.0, 1.2])})[-1]
        == "log_aspect"
    )


def test_clips_that_state_none_of_them_are_refused_with_the_network() -> None:
    with pytest.raises(
        InputError, match="not all clips state any of the targets of the model 'wave-cloth'"
    ):
        judged_targets(estimator.load_shipped("wave-cloth"), {"width": np.ones(2)})
