"""What no estimator could take away: how much the wind's estimate differs among films of one flag in one wind.

Flags of the prior are filmed several times by the same camera in the same light, from starts that differ by a
millimetre, of which nothing is left after the seconds that settle but another phase of the same motion. The estimate's
standard deviation among them is what the cloth's own irregularity costs in a clip of this length; the rest of the error
belongs to the flag and its view, and a better reader could take it away. A second wind, 1 m/s apart, tells how well the
model's summary could be read by somebody who knew all but the wind: 1/σ² = Δm' W⁻¹ Δm / Δv² (Fisher's linear
discriminant), with Δm the difference of the summaries' means and W their covariance within flags.

FLAGDATA_REPLICATES_FLAGS says how many flags (40). The model is the one that is shipped.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.rng import child_seed, stream
from measure.refine.simulator import Request, Simulator
from measure.refine.space import WIND
from measure.refine.view import Camera, DrawnView, View
from models import estimator
from sim.assets import Assets
from sim.datasets.reading import load as load_dataset
from sim.render import RenderParameters
from sim.run.reading import load

FLAGS = int(os.environ.get("FLAGDATA_REPLICATES_FLAGS", "40"))
REPLICATES = 6
APART = 1.0  # m/s, of the two winds of a flag
BINS = (0.0, 3.0, 6.0, 10.0)  # m/s
_SCENE, _DATASET = "flag-wide", "flagsim-wide"


@dataclass(frozen=True)
class _OfFlag:
    """One ζ and camera for all films of a flag, whose number is the seed's quotient by `_FILMS`."""

    drawn: DrawnView

    def at(self, seed: int) -> tuple[RenderParameters, Camera]:
        return self.drawn.at(seed // _FILMS)

    @property
    def identity(self) -> str:
        return self.drawn.identity


_FILMS = 2 * REPLICATES


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Errors of the wind within flags and between them, and what the summary could tell at best."""
    del out
    torch.set_num_threads(1)
    model = estimator.shipped()
    view: View = _OfFlag(DrawnView(prior=load_dataset(_DATASET).prior, assets=Assets()))
    end = model.front_end
    simulator = Simulator.of(load(_SCENE), view, frames=end.frames, rate=end.rate)
    space = simulator.space
    points = space.prior(stream(seed, "flags"), FLAGS)
    low, high = space.wind.low, space.wind.high
    winds = stream(seed, "winds").uniform(low, high - APART, size=FLAGS)[:, None] + np.array([0.0, APART])
    requests = []
    for flag, point in enumerate(points):
        first = child_seed(seed, "replicates") // _FILMS + flag
        for film in range(_FILMS):
            own = point.copy()
            own[WIND] = 2 * (winds[flag, film // REPLICATES] - low) / (high - low) - 1
            requests.append(Request(point=tuple(own), seed=first * _FILMS + film))
    films = simulator.films(requests)
    whole = [n for n in range(FLAGS) if all(film.clip is not None for film in films[n * _FILMS : (n + 1) * _FILMS])]
    clips = [film.clip for n in whole for film in films[n * _FILMS : (n + 1) * _FILMS] if film.clip is not None]
    found = model.estimate(torch.cat([model.inputs(clip[None]) for clip in clips]), seed=seed)
    shape = (len(whole), 2, REPLICATES)
    told = found.mean[:, [target.name for target in found.targets].index("wind_speed")].reshape(shape)
    wind = winds[whole]
    summaries = found.summary.astype(np.float64).reshape(*shape, -1)
    bins = [
        {"from": a, "to": b, **_scores(told[of], wind[of])}
        for a, b in itertools.pairwise(BINS)
        if (of := (wind.mean(axis=1) >= a) & (wind.mean(axis=1) < b)).any()
    ]
    return {
        "model": model.name, "flags": len(whole), "failed": FLAGS - len(whole), "replicates": REPLICATES,
        "apart": APART, "wind": _scores(told, wind), "by_wind": bins,
        "summary_read_by_who_knows_flag_and_view": least_error(summaries, APART),
    }  # fmt: skip


def _scores(told: NDArray[np.float64], wind: NDArray[np.float64]) -> dict[str, float]:
    """Root mean square error of (flag, wind, replicate) estimates, and its two parts [m/s]."""
    error = told - wind[:, :, None]
    within = float(error.var(axis=2, ddof=1).mean())
    whole = float((error**2).mean())
    return {"rmse": whole**0.5, "within_flags": within**0.5, "between_flags": max(whole - within, 0.0) ** 0.5}


def least_error(summaries: NDArray[np.float64], apart: float) -> float:
    """Standard deviation [m/s] of the best linear reading of summaries (flag, 2 winds, replicate, dimension).

    The pooled covariance within flags has n = flags · 2 · (replicates − 1) degrees of freedom, so that its inverse is
    (n − d − 1)/n of the sample's in the mean, and the noise of both means adds 2 d/replicates to Δm' W⁻¹ Δm; both are
    corrected (Muirhead, Aspects of Multivariate Statistical Theory, 1982, section 3.2).
    """
    flags, winds, replicates, dimension = summaries.shape
    means = summaries.mean(axis=2)
    rest = (summaries - means[:, :, None]).reshape(-1, dimension)
    freedom = flags * winds * (replicates - 1)
    inverse = np.linalg.inv(rest.T @ rest / freedom) * (freedom - dimension - 1) / freedom
    difference = means[:, 1] - means[:, 0]
    distance = np.einsum("fi,ij,fj->f", difference, inverse, difference) - 2 * dimension / replicates
    return float(apart / np.sqrt(max(distance.mean(), 1e-12)))
