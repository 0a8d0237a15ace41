"""A verdict's errors as a data set."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.report import answer_of_markers
from measure.verdict import Conclusion
from tests.measure.report.verdicts import verdict


def test_errors_have_their_dimensions_units_and_an_end_where_a_recording_is_shorter() -> None:
    pytest.importorskip("xarray")
    whole = verdict(Conclusion.EFFECT)
    first, *others = whole.residuals
    short = replace(
        first,
        times=first.times[:40],
        in_time=first.in_time[:40],
        in_time_after=first.in_time_after[:40],
    )
    data = answer_of_markers(replace(whole, residuals=(short, *others))).to_xarray()
    assert data.sizes["recording"] == 3
    assert data["in_space_before"].attrs["units"] == "m"
    np.testing.assert_allclose(data["in_space_after"][1], others[0].in_space_after)
    np.testing.assert_allclose(data["in_time_before"][0, :40], short.in_time)
    assert np.isnan(data["in_time_before"][0, 40:]).all()
