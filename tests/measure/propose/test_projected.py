"""Terms in one batch move the predictions as each alone does; their projected statistics are parts
of all statistics."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from measure.forecasting import THETA, Calibration, Column, Forecaster, Segments
from measure.probes.statistics import statistics
from measure.propose import Term, columns_of, made_ready
from measure.propose.projected import ProjectedSegments, of_columns
from measure.trajectories import Experiment

TERMS = columns_of(
    [
        Term(field="leftward", shape="lower"),
        Term(field="mass", shape="near_75_30"),
        Term(field="leftward", shape="everywhere"),
        Term(field="mass", shape="band_50"),
    ]
)


@pytest.fixture(scope="module")
def two(pushed: Experiment) -> tuple[Forecaster, Segments]:
    """Two segments of different winds."""
    setting = made_ready(pushed)
    return setting.forecaster, setting.segments.select([0, 3])


def test_terms_side_by_side_are_what_each_is_alone(two: tuple[Forecaster, Segments]) -> None:
    forecaster, segments = two
    nominal = [Calibration()] * len(segments)
    base = forecaster.errors(*forecaster.system(segments, nominal), segments)
    together = of_columns(forecaster, segments, base, TERMS)
    for column in TERMS:
        alone = forecaster.sensitivity(column, segments, nominal, base)
        # The implicit solver stops at a tolerance of 1e-4, at other bits in a batch of another
        # size.
        assert torch.linalg.vector_norm(
            together[column.name] - alone
        ) < 0.02 * torch.linalg.vector_norm(alone)


def test_projected_statistics_are_the_rows_and_columns_of_all_statistics(
    two: tuple[Forecaster, Segments], directions: tuple[Column, ...]
) -> None:
    """Rows: the directions. Columns: the calibrated parameters and the terms."""
    forecaster, segments = two
    weighed = directions[:3]
    whole = statistics(forecaster, segments, [Calibration()] * len(segments), (*weighed, *TERMS))
    seen = ProjectedSegments.of(forecaster, segments, weighed).of_columns(TERMS)
    rows = len(THETA) + len(weighed)
    kept = [*range(len(THETA)), *range(rows, rows + len(TERMS))]
    size = np.abs(whole.response).max()
    np.testing.assert_allclose(
        seen.r, whole.r[:, :rows], rtol=1e-4, atol=1e-4 * np.abs(whole.r).max()
    )
    # As above: 2 % of the largest.
    np.testing.assert_allclose(
        seen.response, whole.response[:, :rows][:, :, kept], atol=0.02 * size
    )


@pytest.mark.parametrize(
    "name", ["across_squared_lower_fly", "mass_near_72_30", "to_pole_hoist", "mass_stripe_60"]
)
def test_a_term_is_known_by_its_name(name: str) -> None:
    assert Term.named(name).name == name


def test_a_place_is_moved_and_stays_on_the_cloth() -> None:
    assert Term.named("mass_near_90_05").moved(0.12, -0.12).name == "mass_near_100_00"
