"""The recordings of the paper flag themselves: figures that others read off them before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.studies.validation.paper_flag.candidates import Load, loaded
from tests.studies.validation.paper_flag.edge import Seen, scatter, track_edge
from tests.studies.validation.paper_flag.observe import median_by_length, read_thresholds
from tests.studies.validation.paper_flag.recipe import load_case
from tests.studies.validation.paper_flag.sheet import onset
from tests.studies.validation.paper_flag.waves import waves

pytestmark = pytest.mark.reference


@pytest.mark.parametrize(
    ("name", "expected"),
    [("fullVeloc_7.64", 10.4), ("fullVeloc_8.09", 11.7), ("fullVeloc_9.30", 14.5)],
)
def test_the_clips_flutter_at_the_quoted_frequencies(
    reference_data: Path, name: str, expected: float
) -> None:
    case = load_case()
    path = reference_data / case.folder / f"{name}{case.suffix}"
    track = track_edge(
        path, true_rate=case.true_rate, rate=125.0
    )  # six times the third harmonic's need
    found = waves(
        track.time, np.arange(0, 1080, 40.0), track.height[:, ::40], band=(5.0, 25.0)
    ).frequency
    assert found.value == pytest.approx(expected, abs=0.1)  # quoted to a tenth
    assert found.low <= expected + 0.1
    assert found.high >= expected - 0.1
    assert track.share(Seen.LINE) > 0.5
    assert np.nanmedian(scatter(track)) < 0.25  # px


def test_the_reactive_onset_lies_below_the_experiments_of_argentina_and_mahadevan(
    reference_data: Path,
) -> None:
    case = load_case()
    experiments = read_thresholds(case, reference_data).curves["experiments"]
    ratios = []
    for mass_ratio, reduced in experiments:
        length = mass_ratio * case.sheet.mass / case.density
        sheet = loaded(Load(reactive=0.5), bare=case.sheet, length=length, density=case.density)
        speed = reduced * np.sqrt(case.sheet.rigidity / (case.density * length**3))
        ratios.append(onset(sheet, highest=60.0) / speed)
    # An independent calculation with M = ρL/2 (tests/studies/validation/flutter_measured.py) finds
    # 0.44 to 0.67.
    assert min(ratios) == pytest.approx(0.44, abs=0.02)
    assert max(ratios) == pytest.approx(0.67, abs=0.02)


def test_flutter_stops_far_below_where_it_starts(reference_data: Path) -> None:
    thresholds = read_thresholds(load_case(), reference_data)
    stops, starts = (
        dict(median_by_length(thresholds.stop)),
        dict(median_by_length(thresholds.onset)),
    )
    assert set(stops) == set(starts)
    assert all(starts[length] > 1.2 * stops[length] for length in stops)
    assert all(speed > 0 for speed in stops.values())  # a zero in the table is no measurement
