"""Linear recursions over a series."""

from __future__ import annotations

import torch
from torch import Tensor


def decayed(kept: Tensor, given: Tensor) -> Tensor:
    """e_i = kept_i e_{i−1} + given_i from e = 0, by doubling: (n, batch) each."""
    shift = 1
    while shift < len(given):
        given = torch.cat([given[:shift], given[shift:] + kept[shift:] * given[:-shift]])
        kept = torch.cat([kept[:shift], kept[shift:] * kept[:-shift]])
        shift *= 2
    return given
