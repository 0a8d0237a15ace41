"""What every network of clips offers: the input it takes, whether it is recurrent, an embedding of
stated length."""

from __future__ import annotations

from typing import ClassVar, Protocol, runtime_checkable

from torch import Tensor

INPUTS = ("frames", "spectral-maps", "wave-maps", "flow-maps", "flow-maps-3")


@runtime_checkable
class Network(Protocol):
    """A `torch.nn.Module` that embeds clips. A head (a linear layer, a mixture) is a module of its
    own on top.

    Constructors take keyword-only plain numbers, so that a recipe can give them. Frames are float32
    (batch, 1, time, height, width), gray, each clip less its mean and over its standard deviation;
    maps are float32 (batch, channel, height, width).

    Attributes:
        takes: one of `INPUTS`.
        recurrent: gradients are to be clipped to a norm of 10 (Runia et al., supplement C).
        dimension: length of the embedding.
    """

    takes: ClassVar[str]
    recurrent: ClassVar[bool]
    dimension: int

    def forward(self, x: Tensor) -> Tensor:
        """Embeds a batch: (batch, dimension)."""
        ...
