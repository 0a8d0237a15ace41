"""The Gaussian process under Bayesian optimisation and TuRBO: BoTorch's, with a Matérn-5/2 kernel.

Matérn 5/2 with a length scale for each dimension (Snoek, Larochelle and Adams 2012, as the paper),
fitted by the marginal likelihood with BoTorch's priors, which scale with the dimension (Hvarfner,
Hellsten and Nardi 2024).
"""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray
from tests.studies.validation.peers.library import library

_OF = "botorch"
# of the fit; more change the length scales by little, and a noise-free surface takes them all
_STEPS = 100


def fitted(points: FloatArray, values: FloatArray) -> Any:
    """A SingleTaskGP of −log(1 + value), larger being better, on [0, 1]ᵈ.

    Squared distances vary by orders of magnitude; their logarithm is nearer to a Gaussian process.
    Failed evaluations count as the farthest that did not fail.

    Args:
        points: (n, d) of [−1, 1]ᵈ.
        values: (n,), at least 0; infinite where one failed.
    """
    models = library("botorch.models", of=_OF)
    kernels = library("gpytorch.kernels", of="gpytorch")
    priors = library("gpytorch.priors", of="gpytorch")
    constraints = library("gpytorch.constraints", of="gpytorch")
    likelihoods = library("gpytorch.mlls", of="gpytorch")
    transforms = library("botorch.models.transforms", of=_OF)
    fit = library("botorch.fit", of=_OF)
    x, y = unit(points), torch.from_numpy(gains(values))[:, None]
    dimension = x.shape[1]
    prior = priors.LogNormalPrior(loc=math.sqrt(2) + 0.5 * math.log(dimension), scale=math.sqrt(3))
    kernel = kernels.MaternKernel(
        nu=2.5,
        ard_num_dims=dimension,
        lengthscale_prior=prior,
        lengthscale_constraint=constraints.GreaterThan(2.5e-2, initial_value=prior.mode),
    )
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore"
        )  # of the linear algebra's jitter, and the deprecations of torch's own tracing
        model = models.SingleTaskGP(
            x, y, covar_module=kernel, outcome_transform=transforms.Standardize(m=1)
        )
        fit.fit_gpytorch_mll(
            likelihoods.ExactMarginalLogLikelihood(model.likelihood, model),
            optimizer_kwargs={"options": {"maxiter": _STEPS}},
        )
    return model


def gains(values: FloatArray) -> FloatArray:
    """−log(1 + value) of (n,); failed ones as the worst of the others, 0 if there are none."""
    finite = np.isfinite(values)
    worst = float(values[finite].max()) if finite.any() else 0.0
    return -np.log1p(np.where(finite, values, worst))


def unit(points: FloatArray) -> Tensor:
    """[−1, 1]ᵈ to [0, 1]ᵈ, as BoTorch's priors expect."""
    return torch.from_numpy((points + 1) / 2).double()


def signed(points: Tensor) -> FloatArray:
    """[0, 1]ᵈ to [−1, 1]ᵈ."""
    return np.clip(points.detach().cpu().numpy() * 2 - 1, -1.0, 1.0)
