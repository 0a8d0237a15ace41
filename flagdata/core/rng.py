"""Randomness by named streams from one seed, so that a new camera draw does not move the gusts."""

from __future__ import annotations

import hashlib
import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import torch


def stream(seed: int, *names: str | int) -> np.random.Generator:
    """Makes a generator that depends on `seed` and the path of `names` alone.

    `stream(7, "sequence", 12, "wind")` is the same whatever other streams were drawn, and in what
    order. The names are hashed (SHA-256) into a `SeedSequence`'s entropy; the bit generator is
    PCG64DXSM. A number of NumPy or torch is the whole number that it equals.
    """
    path = "\x1f".join(map(_typed_name, names))
    digest = hashlib.sha256(path.encode()).digest()
    words = np.frombuffer(digest, dtype="<u4").tolist()
    entropy = [operator.index(seed) & (2**64 - 1), *words]
    return np.random.Generator(np.random.PCG64DXSM(np.random.SeedSequence(entropy)))


def _typed_name(name: str | int) -> str:
    """Writes a name with its kind, so that the number 3 is another than the text "3"."""
    if isinstance(name, str | int | float):
        return f"{'str' if isinstance(name, np.str_) else type(name).__name__}:{name}"
    return f"int:{operator.index(name)}"


def child_seed(seed: int, *names: str | int) -> int:
    """Draws a 63-bit seed for a library that wants an integer, from the same named stream."""
    return int(stream(seed, *names).integers(0, 2**63 - 1))


def torch_generator(
    seed: int, *names: str | int, device: torch.device | str = "cpu"
) -> torch.Generator:
    """Makes a generator of torch's on a device, for the named stream."""
    import torch

    generator = torch.Generator(device=device)
    generator.manual_seed(child_seed(seed, *names))
    return generator


@contextmanager
def torch_draws(seed: int, *names: str | int) -> Iterator[None]:
    """Lets what draws from torch's own generator of the CPU, as layers do for their weights, draw
    from the named stream; that generator is afterwards as it was."""
    import torch

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(child_seed(seed, *names))
        yield
