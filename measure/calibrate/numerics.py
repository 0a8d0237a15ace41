"""What a coarse mesh does to summaries, measured once: part of every answer's scatter.

`python -m tests.validation weighed` simulates sixteen of the same flags in the same winds on a mesh of 18 columns and
reports both tables: the mean of the differences, fine less coarse, and their standard deviation, which includes that no
two runs of a flag show the same folds.
"""

from __future__ import annotations

import numpy as np

BIAS = np.array([
    [0.0027, 0.0011, -0.0038, -0.0359, -0.0153, 0.0082, -0.0024, -0.0051],
    [-0.0275, 0.0212, -0.0409, 0.0323, 0.0299, -0.0093, -0.0130, 0.0201],
])  # fmt: skip
"""(2, observable of `simulation.OBSERVED`) of the mean and of the slope with ln U, in the observables' units."""
SIGMA = np.array([
    [0.0085, 0.0042, 0.0296, 0.0365, 0.0273, 0.0150, 0.0130, 0.0037],
    [0.0494, 0.0257, 0.2287, 0.4161, 0.2548, 0.0958, 0.0648, 0.0400],
])  # fmt: skip
"""Their standard deviations."""
