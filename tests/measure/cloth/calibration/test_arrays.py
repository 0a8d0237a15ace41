"""Calibration from Python: arrays are the table of the same numbers, and the answer that of the
calibration."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import flagdata
from flagdata.errors import InputError, UnknownNameError, UsageError
from measure.cloth import OBSERVED, calibrate_call, of_table
from measure.film import FlagSize
from tests.measure.cloth.calibration.conftest import readings

COLUMNS = {
    "time": 100.0 + 0.5 * np.arange(80),
    "wind": 4.0 + np.sin(np.arange(80) / 9),
    "droop": 0.3 + 0.01 * np.arange(80),
    "amplitude_up": np.full(80, 0.2),
    "droop_sigma": np.full(80, 0.05),
}


def test_arrays_are_the_table_of_the_same_numbers(tmp_path: Path) -> None:
    names = [name.replace("_", "-") for name in COLUMNS]
    rows = [
        ",".join(f"{value!r}" for value in row)
        for row in zip(*(c.tolist() for c in COLUMNS.values()), strict=True)
    ]
    path = tmp_path / "t.csv"
    path.write_text("\n".join([",".join(names), *rows]) + "\n")
    (expected,) = of_table(path, FlagSize(length=1.5, height=1.0))
    (found,) = calibrate_call.of_arrays(COLUMNS, name="recording 1")
    np.testing.assert_allclose(found.readings, expected.readings)
    np.testing.assert_allclose(found.sigma, expected.sigma)
    np.testing.assert_allclose(found.log.times, expected.log.times, atol=1e-9)
    np.testing.assert_array_equal(found.log.speed, expected.log.speed)
    assert found.readings.shape[1] == len(OBSERVED)


@pytest.mark.parametrize(
    ("columns", "match"),
    [
        ({"time": np.arange(3), "wind": np.arange(4)}, "of one n"),
        ({"time": np.arange(9), "drop": np.arange(9)}, "drop"),
    ],
)
def test_columns_that_make_no_table_are_refused(columns: dict, match: str) -> None:
    with pytest.raises(InputError, match=match):
        flagdata.calibrate(columns, flag_size=(1.5, 1.0))


def test_a_material_of_which_none_was_measured_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="no cloth like 'silk'") as refused:
        flagdata.calibrate(COLUMNS, flag_size=(1.5, 1.0), material="silk")
    assert refused.value.where == "material"


def test_an_azimuth_is_given_as_on_the_command_line() -> None:
    with pytest.raises(UsageError, match="azimuth_deg"):
        flagdata.calibrate(COLUMNS, flag_size=(1.5, 1.0), azimuth_deg="200±7")


@pytest.mark.usefixtures("cheap")
def test_a_flag_is_weighed_from_arrays(tmp_path: Path) -> None:
    """Windows of a flag of 0.17 kg/m² whose law is known."""
    wind = 5.0 + 1.5 * np.sin(np.arange(48) / 3)
    values = {
        "area_weight": np.array([0.17]),
        "gain": np.array([1.0]),
        "damping": np.array([0.01]),
        "azimuth": np.array([math.radians(70)]),
    }
    seen = readings(values, wind, seed=9)[0]
    table = {
        "time": 1.25 + 2.5 * np.arange(48),
        "wind": wind,
        **dict(zip(OBSERVED, seen.T, strict=True)),
    }
    found = flagdata.calibrate(
        table, flag_size=(1.5, 1.0), azimuth_deg="70±7", seed=4, cache=tmp_path
    )
    assert found.area_weight == pytest.approx(0.17, rel=0.1)
    low, high = found.quantities["area_weight"].interval
    assert low < 0.17 < high
    assert np.quantile(found.draws["area_weight"], 0.5) == pytest.approx(found.area_weight)
    assert found.stated is not None
    assert found.stated in f"{found.area_weight:.4g}±{found.quantities['area_weight'].sigma:.2g}"
    assert repr(found) == f"Calibrated({found.sentence})"
    assert "area weight" in found._repr_html_()
