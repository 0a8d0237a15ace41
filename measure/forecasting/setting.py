"""An experiment made ready for the loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray, IntArray
from measure.forecasting.alignment import align_experiment
from measure.forecasting.calibrated_parameters import PRIOR_WITHOUT_MASS, Calibration, prior
from measure.forecasting.observer import Forecaster
from measure.forecasting.segments import Segments
from measure.trajectories.trajectory import Experiment
from sim.integrate.split import SplitEuler

Stage = Callable[[str, int, int], object]
"""Called with what is under way, how much is done, and of how much."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """How the cloth is observed, which moves the mean of what numerics leave.

    Attributes:
        noise: of a marker's coordinate [m].
        period: between the frames that are used [s].
        cloth: `Material.fingerprint` of the nominal one.
        damping: of the base model that the statistics are taken at [s].
    """

    noise: float
    period: float
    cloth: str
    damping: float = Calibration().damping


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """An experiment made ready: in one frame, cut into segments, with the model that predicts them.

    Attributes:
        calibration: of the base model that statistics are taken at: the nominal one, then the
            fitted one.
    """

    experiment: Experiment
    segments: Segments
    forecaster: Forecaster
    calibration: Calibration

    @classmethod
    def of(cls, experiment: Experiment, *, workers: int = 1) -> Setting:
        """Makes the setting, with a model that uses so many threads.

        Raises:
            InputError: recordings that cannot be used together, or are too short.
        """
        turned = align_experiment(experiment)
        segments = Segments.of(turned.recordings)
        forecaster = Forecaster(
            specimen=turned.specimen,
            markers=segments.markers,
            integrator=SplitEuler(),
            workers=workers,
        )
        return cls(
            experiment=turned, segments=segments, forecaster=forecaster, calibration=Calibration()
        )

    @property
    def speeds(self) -> FloatArray:
        """(recording,) mean logged wind [m/s]."""
        return np.array([r.wind.speed for r in self.experiment.recordings])

    @property
    def tolerance(self) -> float:
        """Standard deviation that the direction of the wind's logs is declared with, the largest of
        them [rad]."""
        return max(r.wind.direction for r in self.experiment.recordings)

    @property
    def design(self) -> Design:
        """Its markers are as noisy as in the noisiest recording."""
        return Design(
            noise=float(self.segments.noise.max()),
            period=self.segments.period,
            cloth=self.experiment.specimen.material.fingerprint,
            damping=self.calibration.damping,
        )

    def moved(self, lags: Sequence[float]) -> Setting:
        """Moves each recording's log by what it lags [s]."""
        recordings = tuple(
            replace(recording, wind=recording.wind.later(lag))
            for recording, lag in zip(self.experiment.recordings, lags, strict=True)
        )
        items = tuple(
            replace(item, wind=recordings[item.recording].wind) for item in self.segments.items
        )
        return replace(
            self,
            experiment=replace(self.experiment, recordings=recordings),
            segments=replace(self.segments, items=items),
        )

    @property
    def prior(self) -> FloatArray:
        """(theta,) standard deviations of the calibrated parameters."""
        uncertainty = self.experiment.specimen.area_weight_uncertainty
        return PRIOR_WITHOUT_MASS if uncertainty is None else prior(uncertainty)

    @property
    def recording(self) -> IntArray:
        """(segment,) index of each one's recording."""
        return self.segments.recording
