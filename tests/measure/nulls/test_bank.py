"""Null recordings are predicted from what a user would give; anchors not given are taken from the
recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from measure.forecasting import Calibration, EffectColumn, Forecaster, Segments
from measure.nulls import NullBatch, evaluate
from measure.probes.statistics import statistics
from measure.trajectories import Specimen, as_seen
from sim.integrate import SplitEuler

LEAN = EffectColumn(effect="tilted-pole", parameter="lean", step=0.02)
CLOTHS = (
    Calibration(area_weight=1.2, damping=2e-3),
    Calibration(area_weight=0.8, bending=2.0, damping=2e-3),
)


@pytest.fixture(scope="module")
def batch(specimen: Specimen) -> NullBatch:
    """Two cloths, each in two winds, on soft springs: anchors are seen some millimetres downstream
    of themselves."""
    soft = replace(specimen, stiffness=100.0, anchors_given=False)
    return NullBatch(
        specimen=soft,
        markers=specimen.mesh.rest,
        rate=25.0,
        duration=2.4,
        noise=0.0,
        seed=4,
        calibrations=tuple(cloth for cloth in CLOTHS for _ in range(2)),
        speeds=(4.0, 6.0, 4.0, 6.0),
    )


def test_anchors_that_are_not_given_are_taken_from_the_recordings_of_each_cloth(
    batch: NullBatch,
) -> None:
    nulls, _ = evaluate(batch, 0, (LEAN,))
    recordings = batch.simulate()
    shown = [as_seen(batch.specimen, recordings[first : first + 2]) for first in (0, 2)]
    downstream = [float((own.anchors - batch.specimen.anchors)[:, 0].min()) for own in shown]
    # A change of the wind by 1e-6 m/s moves the mean of this chaotic motion by a tenth: about 1 mm,
    # on any platform.
    assert min(downstream) > 5e-4
    for place, own in enumerate(shown):
        segments = Segments.of(recordings)
        segments = segments.select(np.flatnonzero(segments.recording // 2 == place))
        forecaster = Forecaster(specimen=own, markers=batch.markers, integrator=SplitEuler())
        expected = statistics(forecaster, segments, [CLOTHS[place]] * len(segments), (LEAN,))
        found = nulls.select(nulls.statistics.recording // 2 == place)
        # Single precision, and a solver that stops for all members of a batch at once.
        np.testing.assert_allclose(found.statistics.r, expected.r, rtol=1e-3)
        steps = CLOTHS[place].steps_from(Calibration())
        np.testing.assert_allclose(found.calibration, np.tile(steps, (len(segments), 1)))


def test_given_anchors_are_those_of_the_simulation(batch: NullBatch) -> None:
    given = replace(batch, specimen=replace(batch.specimen, anchors_given=True))
    unlike, like = (evaluate(own, 0, (LEAN,))[0].statistics for own in (batch, given))
    # Anchors a stretch too far downstream: the model's own springs draw it once more, and all
    # errors grow.
    assert like.error.mean() < unlike.error.mean()
