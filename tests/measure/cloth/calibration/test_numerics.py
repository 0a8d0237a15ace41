"""The fit's distance from a finer mesh: which flags are simulated again, and what their difference
comes to."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from measure.cloth import FLAGS, MEASURED, OBSERVED, Design, Finer, Flag, Log
from measure.cloth.numerics import FINE, LASTING

WINDOWS, SEEN = 12, 5


@pytest.fixture(scope="module")
def design() -> Design:
    times = np.arange(-20.0, 32.0)
    log = Log(times=times, speed=5.0 + np.sin(times / 5), distance=3.0)
    return Design(
        flag=Flag(length=1.5, height=1.0), log=log, duration=30.0, count=128, recording="monday"
    )


def test_finer_flags_are_the_fits_own_but_for_the_mesh_and_the_steps(design: Design) -> None:
    finer = Finer.of(design)
    values = design.values()
    assert len(finer.indices) == len(set(finer.indices.tolist())) == FLAGS
    assert np.concatenate([one.values["area_weight"] for one in finer.batches]).tolist() == (
        values["area_weight"][finer.indices].tolist()
    )
    seeds = [seed for batch in design.batches() for seed in batch.seeds]
    assert [seed for one in finer.batches for seed in one.seeds] == [
        seeds[place] for place in finer.indices
    ]
    assert values["damping"][finer.indices].min() >= 2e-3  # what the shorter step damps by itself
    for one in finer.batches:
        assert (one.step, one.until, one.discretisation) == (2e-3, LASTING, FINE)
        mesh = FINE.mesh(design.flag.mesh(one.columns))
        assert len(np.unique(mesh.rest[:, 0].round(6))) == 21


def test_the_mean_difference_corrects_and_its_scatter_beyond_chaos_is_drawn(design: Design) -> None:
    """Chaos of a window 0.1, of the mesh 0.05 from flag to flag about 0.2: the mean is known to
    0.05/√32 and more."""
    rng, finer = stream(1, "tests", "numerics"), Finer.of(design)
    coarse = rng.normal(0.0, 0.1, (design.count, WINDOWS, len(OBSERVED)))
    own = 0.2 + 0.05 * rng.standard_normal((FLAGS, 1, len(OBSERVED)))
    fine = (
        own + coarse[finer.indices][:, :SEEN] + rng.normal(0.0, 0.1, (FLAGS, SEEN, len(OBSERVED)))
    )
    found = finer.correction(fine, coarse)
    error = np.hypot(0.05, 0.1 / np.sqrt(SEEN)) / np.sqrt(FLAGS)
    assert found.mean[0] == pytest.approx(0.2, abs=4 * error)
    assert np.sqrt(np.square(found.sigma[0]).mean()) == pytest.approx(
        np.hypot(0.05, error), rel=0.2
    )
    assert (found.mean[1] == MEASURED.mean[1]).all()
    drawn = found.of(np.zeros((4000, 2, len(OBSERVED))), seed=3)
    assert drawn[:, 0].mean(axis=0) == pytest.approx(found.mean[0], abs=0.005)
    assert drawn[:, 0].std(axis=0) == pytest.approx(found.sigma[0], rel=0.05)


def test_what_too_few_finer_flags_show_has_what_was_measured_once(design: Design) -> None:
    finer = Finer.of(design)
    coarse = np.zeros((design.count, WINDOWS, len(OBSERVED)))
    fine = np.ones((FLAGS, SEEN, len(OBSERVED)))
    fine[7:, :, 2] = np.nan
    found = finer.correction(fine, coarse)
    assert found.mean[0, 2] == MEASURED.mean[0, 2]
    assert found.sigma[0, 2] == MEASURED.sigma[0, 2]
    assert found.mean[0, 3] == 1.0
    assert found.sigma[0, 3] == 0.0


def test_finer_flags_are_another_batch_than_the_fits(design: Design) -> None:
    one = Finer.of(design).batches[0]
    assert one.content() != design.batch(Finer.of(design).indices[:8]).content()
