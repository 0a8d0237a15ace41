"""The example that comes with the package: small, read and measured as any film and log, its truth
in the intervals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

import flagdata
from flagdata.errors import UnknownNameError
from flagdata.examples import names
from measure.commands.measure import measure
from tests.golden_answers import changes


def test_the_examples_fit_into_a_package() -> None:
    assert names() == ("flag",)
    flag = flagdata.example("flag")
    folder = flag.film.parent
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1.5e6
    with pytest.raises(UnknownNameError, match="did you mean 'flag'"):
        flagdata.example("flagg")
    assert "4.34 m/s" in repr(flag)
    assert "true area weight" in flag._repr_html_()


def test_film_and_log_are_of_the_flag_that_is_stated() -> None:
    flag = flagdata.example()
    film = flagdata.frames(flag.film, end=0.5)
    assert film.images.shape == (13, 300, 400)
    assert film.rate == pytest.approx(25.0)
    wind = flagdata.wind("example:flag")
    # The film's clock starts at 09:30:00; the log's is ahead of it by what is stated.
    during = wind.start * 1e-9 + wind.time - 1778751000.0 - flag.clock_offset
    logged = wind.speed[(during >= 0) & (during <= 12)]
    assert len(logged) == 12
    # A cup lags by half a second, and its noise is 0.05 m/s: 12 readings follow the mean within 0.1
    # m/s.
    assert logged.mean() == pytest.approx(flag.truth["wind_speed"], abs=0.1)
    assert np.isfinite(wind.direction).all()


def test_the_command_measures_the_example_with_its_truth_beside() -> None:
    """The flag's size is taken from the example: with none the answer would be of the network's own
    flag.

    `tests/test_readme.py` makes the same measurement by the call.
    """
    done = CliRunner().invoke(measure, ["example:flag", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert changes("measure", found, relative=1e-3) == []  # a network in single precision
    flag = flagdata.example()
    wind = found["quantities"]["wind_speed"]
    assert wind["interval"][0] < flag.truth["wind_speed"] < wind["interval"][1]
    assert found["simulated_with"]["wind_speed"] == flag.truth["wind_speed"]
