"""Optimisers by name, and how one is driven."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.recipes.registry import Registry
from measure.refine import Trace

PEERS = Registry(
    "optimiser",
    {
        "random": "tests.studies.validation.peers.uniform:RandomSearch",
        "bayesian": "tests.studies.validation.peers.bayesian:BayesianOptimisation",
        "turbo": "tests.studies.validation.peers.turbo:Turbo",
        "cma-es": "tests.studies.validation.peers.cma_es:CmaEs",
    },
)
"""name → class; each is made of `(dimension, *, seed, batch)`."""


class Optimiser(Protocol):
    """Asks for points and gets their values. The same seed and answers give the same questions."""

    def ask(self) -> FloatArray:
        """Points (q, d) of [−1, 1]ᵈ to be evaluated next; the first is the centre."""
        ...

    def tell(self, points: FloatArray, values: FloatArray) -> None:
        """What `ask`'s points gave: (q,), to be made small; infinite where a simulation failed."""
        ...


Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Points (q, d) → values (q,) and the seconds that each took when it was made (q,)."""


def minimise(
    method: str, evaluate: Evaluate, *, dimension: int, budget: int, seed: int, batch: int = 1
) -> Trace:
    """Run an optimiser for `budget` evaluations.

    Args:
        method: a name of `PEERS`.
        dimension: of the points.
        seed: of its random streams.
        batch: points that are asked for at once; CMA-ES has its own.

    Raises:
        UnknownNameError: no such optimiser.
        InputError: its library is not installed.
    """
    optimiser: Optimiser = PEERS[method](dimension, seed=seed, batch=batch)
    points: list[FloatArray] = []
    values: list[float] = []
    seconds: list[float] = []
    spent = 0.0
    while len(values) < budget:
        begun = time.perf_counter()
        asked = optimiser.ask()[: budget - len(values)]
        spent += time.perf_counter() - begun
        found, took = evaluate(asked)
        begun = time.perf_counter()
        optimiser.tell(asked, found)
        spent += time.perf_counter() - begun
        for point, value, own in zip(asked, found.tolist(), took.tolist(), strict=True):
            spent += own
            points.append(point)
            values.append(value)
            seconds.append(spent)
    return Trace(
        method=method,
        points=np.array(points),
        distances=np.array(values),
        seconds=np.array(seconds),
    )
