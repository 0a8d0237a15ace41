"""The arithmetic of `looks`, on errors whose shares are known, and the place of a flag that is
filmed once more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.core.rng import stream
from measure.cloth import OBSERVED, Flag
from measure.observables import edges_of
from sim.render import RenderParameters
from tests.studies.validation.looks import common_of_all, factors, judged, share
from tests.studies.validation.looks_films import Place, meshes_of, places
from tests.studies.validation.looks_refilmed import aimed

_SHARES = np.linspace(0.1, 0.9, len(OBSERVED))


def _films(count: int, windows: int, *, together: float, seed: int) -> list[dict[str, object]]:
    """Rows of two films a look, whose windows' errors have a variance of one."""
    rng = stream(seed, "test looks")
    size = len(OBSERVED)
    found: list[dict[str, object]] = []
    for number in range(count):
        shared = rng.standard_normal(size)
        for film in range(2):
            lasting = np.sqrt(together) * shared + np.sqrt(1 - together) * rng.standard_normal(size)
            errors = np.sqrt(_SHARES) * lasting + np.sqrt(1 - _SHARES) * rng.standard_normal(
                (windows, size)
            )
            found.append({"look": number, "film": film, "errors": errors.tolist()})
    return found


def test_the_share_that_lasts_is_found() -> None:
    films = [np.array(one["errors"]) for one in _films(400, 3, together=0.0, seed=1)]
    # Some films have one window: the analysis of variance of unequal groups.
    found = share([own[: 1 + number % 3] for number, own in enumerate(films)])
    assert found == pytest.approx(_SHARES, abs=0.1)


def test_what_two_films_of_a_look_share_is_found() -> None:
    for together in (0.0, 0.5, 1.0):
        assert common_of_all(_films(400, 4, together=together, seed=2)) == pytest.approx(
            together, abs=0.12
        )


def test_a_correction_counts_only_where_it_predicts() -> None:
    rng = stream(3, "test looks")
    errors = rng.standard_normal((40, len(OBSERVED)))
    good, bad = (
        0.9 * errors + 0.1 * rng.standard_normal(errors.shape),
        rng.standard_normal(errors.shape),
    )
    whole = np.ones(len(OBSERVED))
    assert judged(errors, good, whole)["mean_log"] < -2
    assert judged(errors, bad, whole)["mean_log"] > 0.4  # twice the variance
    assert factors(errors, good).min() > 0.9
    assert factors(errors, bad).max() < 0.4


def test_a_flag_is_drawn_where_the_films_hoist_is() -> None:
    flag = Flag(length=1.5, height=1.0)
    mesh = flag.mesh(6)
    positions = np.stack(
        [mesh.rest[:, 0], 0.2 * np.sin(3 * mesh.rest[:, 0]), mesh.rest[:, 1]], axis=1
    )[None]
    hoist, _ = edges_of(mesh.rest)
    zeta = RenderParameters(background="film/own", texture="film/own", width=300, height=300)
    place = Place(azimuth=1.1, elevation=0.1, distance=9.0, wide=0.5)
    zeta = place.put(zeta, positions, int(hoist[0]), flag.length)
    meshes = meshes_of(np.repeat(positions, 2, axis=0), mesh)
    wanted = np.array([[70.0, 60.0], [70.0, 190.0]])

    def ends(one: RenderParameters) -> np.ndarray:
        return places(meshes, one)[:, [hoist[0], hoist[-1]]].mean(axis=0)

    found = ends(aimed(replace(zeta), ends, wanted))
    assert found.mean(axis=0) == pytest.approx(wanted.mean(axis=0), abs=0.3)
    assert found[1, 1] - found[0, 1] == pytest.approx(130.0, rel=0.01)
