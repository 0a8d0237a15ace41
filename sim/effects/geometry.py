"""Small geometry that several effects share."""

from __future__ import annotations

import torch
from torch import Tensor


def norm(vectors: Tensor) -> Tensor:
    """(n, 1, batch) lengths of (n, 3, batch); their gradient is 0 at 0, not NaN."""
    square = (vectors * vectors).sum(1, keepdim=True)
    positive = square > 0
    return torch.where(positive, torch.where(positive, square, 1.0).sqrt(), 0.0)
