"""Linear recursions over a series."""

from __future__ import annotations

import torch
from torch import Tensor


def decaying_sum(memory: Tensor, addend: Tensor) -> Tensor:
    """Computes e_i = memory_i e_{i−1} + addend_i from e = 0, by doubling: (n, batch) each."""
    shift = 1
    while shift < len(addend):
        addend = torch.cat([addend[:shift], addend[shift:] + memory[shift:] * addend[:-shift]])
        memory = torch.cat([memory[:shift], memory[shift:] * memory[:-shift]])
        shift *= 2
    return addend
