"""What a coarse mesh does to summaries, measured once: part of every answer's scatter.

`python -m tests.validation weighed` simulates sixteen of the same flags in the same winds on a mesh of 18 columns and
reports both tables: the mean of the differences, fine less coarse, and their standard deviation, which includes that no
two runs of a flag show the same folds.
"""

from __future__ import annotations

import numpy as np

BIAS = np.zeros((2, 8))
"""(2, observable of `simulation.OBSERVED`) of the mean and of the slope with ln U, in the observables' units."""
SIGMA = np.zeros((2, 8))
"""Their standard deviations."""
