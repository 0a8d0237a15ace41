"""The paper's optimiser: a Gaussian process with Matérn 5/2 and expected improvement, from the
centre.

Runia et al. 2020, sections 3.2 and 6. Expected improvement is maximised by its logarithm (Ament et
al., NeurIPS 2023), which has the same maximum and gradients that do not vanish; several points at
once by its batched form.
"""

from __future__ import annotations

import warnings

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream, torch_draws
from tests.studies.validation.peers.gaussian import fitted, signed
from tests.studies.validation.peers.library import library

_FIRST = 2  # evaluations that a Gaussian process needs to be standardised
_RESTARTS, _RAW, _STEPS = 4, 128, 100


class BayesianOptimisation:
    """See `registry.Optimiser`. The second point, before there is anything to fit, is drawn."""

    def __init__(self, dimension: int, *, seed: int, batch: int) -> None:
        self._dimension, self._seed, self._batch = dimension, seed, batch
        self._points = np.zeros((0, dimension))
        self._values = np.zeros(0)

    def ask(self) -> FloatArray:
        count = len(self._points)
        if count == 0:
            return np.zeros((1, self._dimension))
        if count < _FIRST:
            rng = stream(self._seed, "peers", "bayesian", "second")
            return rng.uniform(-1.0, 1.0, (self._batch, self._dimension))
        logei = library("botorch.acquisition.logei", of="botorch")
        analytic = library("botorch.acquisition.analytic", of="botorch")
        sampling = library("botorch.sampling.normal", of="botorch")
        optim = library("botorch.optim", of="botorch")
        bounds = torch.tensor(
            [[0.0] * self._dimension, [1.0] * self._dimension], dtype=torch.double
        )
        with torch_draws(self._seed, "peers", "bayesian", count), warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # of starts that did not converge; the best of them is taken
            model = fitted(self._points, self._values)
            best = model.outcome_transform.untransform(model.train_targets[:, None])[0].max()
            if self._batch == 1:
                acquisition = analytic.LogExpectedImprovement(model, best_f=best)
            else:
                sampler = sampling.SobolQMCNormalSampler(
                    torch.Size([128]),
                    seed=child_seed(self._seed, "peers", "bayesian", "sampler", count) % 2**31,
                )
                acquisition = logei.qLogExpectedImprovement(model, best_f=best, sampler=sampler)
            found, _ = optim.optimize_acqf(
                acquisition,
                bounds=bounds,
                q=self._batch,
                num_restarts=_RESTARTS,
                raw_samples=_RAW,
                options={
                    "maxiter": _STEPS,
                    "seed": child_seed(self._seed, "peers", "bayesian", "starts", count) % 2**31,
                },
            )
        return signed(found)

    def tell(self, points: FloatArray, values: FloatArray) -> None:
        self._points = np.concatenate([self._points, points])
        self._values = np.concatenate([self._values, values])
