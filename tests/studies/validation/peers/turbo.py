"""TuRBO: Bayesian optimisation within a trust region that grows with success and shrinks with
failure.

Eriksson, Pearce, Gardner, Turner and Poloczek, Scalable global optimization via local Bayesian
optimization, NeurIPS
2019: one region, Thompson sampling over perturbed Sobol candidates, on BoTorch's Gaussian process.
Lengths and tolerances are that paper's.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream, torch_draws
from tests.studies.validation.peers.gaussian import fitted, gains, signed, unit
from tests.studies.validation.peers.library import library

LENGTH, LEAST, MOST = 0.8, 0.5**7, 1.6
"""Length of the region's side in [0, 1]ᵈ: at the start, where it starts anew, and at most."""
SUCCESSES = 3
"""In a row after which it doubles."""
_INITIAL = 10
_CANDIDATES = 2000


class Turbo:
    """See `registry.Optimiser`. It begins with the centre and draws of a Sobol sequence."""

    def __init__(self, dimension: int, *, seed: int, batch: int) -> None:
        self._dimension, self._seed, self._batch = dimension, seed, batch
        self._restart = 0
        self._asked = 0
        self._tolerance = math.ceil(max(4.0 / batch, dimension / batch))
        self._fresh()

    def _fresh(self) -> None:
        self._length, self._successes, self._failures = LENGTH, 0, 0
        self._points = np.zeros((0, self._dimension))
        self._values = np.zeros(0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            sobol = torch.quasirandom.SobolEngine(
                self._dimension,
                scramble=True,
                seed=child_seed(self._seed, "peers", "turbo", self._restart) % 2**31,
            )
            self._initial = list(signed(sobol.draw(_INITIAL).double()))
        if self._restart == 0:
            self._initial[0] = np.zeros(self._dimension)

    def ask(self) -> FloatArray:
        if len(self._points) < _INITIAL:
            first = len(self._points)
            return np.array(self._initial[first : first + self._batch])
        self._asked += 1
        return self._thompson()

    def _thompson(self) -> FloatArray:
        generation = library("botorch.generation", of="botorch")
        rng = stream(self._seed, "peers", "turbo", "candidates", self._asked)
        with (
            torch_draws(self._seed, "peers", "turbo", "fit", self._asked),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")  # of the linear algebra's jitter
            model = fitted(self._points, self._values)
            centre = unit(self._points[[int(np.argmin(self._values))]])[0]
            weights = model.covar_module.lengthscale.detach().flatten()
            weights = weights / weights.log().mean().exp()
            low = (centre - weights * self._length / 2).clamp(0.0, 1.0)
            high = (centre + weights * self._length / 2).clamp(0.0, 1.0)
            drawn = low + (high - low) * torch.from_numpy(
                rng.random((_CANDIDATES, self._dimension))
            )
            moved = torch.from_numpy(rng.random((_CANDIDATES, self._dimension))) <= min(
                20 / self._dimension, 1.0
            )
            still = (~moved).all(dim=1)
            moved[still, torch.from_numpy(rng.integers(self._dimension, size=int(still.sum())))] = (
                True
            )
            candidates = torch.where(moved, drawn, centre)
            chosen = generation.MaxPosteriorSampling(model, replacement=False)(
                candidates, num_samples=self._batch
            )
        return signed(chosen)

    def tell(self, points: FloatArray, values: FloatArray) -> None:
        judged = len(self._points) >= _INITIAL
        before = gains(np.append(self._values, values)) if judged else None
        self._points = np.concatenate([self._points, points])
        self._values = np.concatenate([self._values, values])
        if before is None:
            return
        best, new = before[: -len(values)].max(), before[-len(values) :].max()
        if new > best + 1e-3 * abs(best):
            self._successes, self._failures = self._successes + 1, 0
        else:
            self._successes, self._failures = 0, self._failures + 1
        if self._successes == SUCCESSES:
            self._length, self._successes = min(2 * self._length, MOST), 0
        elif self._failures == self._tolerance:
            self._length, self._failures = self._length / 2, 0
        if self._length < LEAST:
            self._restart += 1
            self._fresh()
