"""The networks that the paper compares its own with: single images, averaged images, and images
read in sequence.

All are trained from scratch here: ImageNet weights are not distributed with this project. `note` of
each class says so in the tables.
"""

from __future__ import annotations

from typing import ClassVar

import torch
from torch import Tensor, nn

from flagdata.errors import InputError
from models.networks.blocks import ResNet18, initialise

SMALLEST = 64
"""Least height and width [px] of frames: below it the last feature maps of these networks are
single pixels."""


def evenly_spaced(clip_frames: int, count: int) -> Tensor:
    """Returns the indices of the frames in the middle of `count` equal parts of a clip: (count,)
    int64.

    Raises:
        InputError: more frames than the clip has.
    """
    if not 1 <= count <= clip_frames:
        raise InputError(
            f"{count} frames cannot be selected from a clip of {clip_frames}",
            fix=f"take from 1 to {clip_frames} frames, or longer clips",
        )
    return ((2 * torch.arange(count) + 1) * clip_frames) // (2 * count)


def _select_frames(x: Tensor, count: int) -> Tensor:
    """Returns evenly spaced frames of clips (batch, 1, time, height, width) as images (batch ·
    count, 1, h, w)."""
    if x.ndim != 5 or x.shape[1] != 1 or min(x.shape[3:]) < SMALLEST:
        raise InputError(
            f"the clips have the shape {tuple(x.shape)}",
            fix="give gray clips (batch, 1, time, height, width) of at least "
            f"{SMALLEST}×{SMALLEST} pixels",
        )
    index = evenly_spaced(x.shape[2], count).to(x.device)
    return x.index_select(2, index).transpose(1, 2).flatten(0, 1)


class ResNetOfFrames(nn.Module):
    """ResNet-18 of n frames, its final activations averaged over space and then over the frames:
    (batch, 512).

    Late fusion by temporal average pooling, as Runia et al. (CVPR 2020, section 6) use it after
    Karpathy et al. (Large-scale Video Classification, CVPR 2014), with 1, 10 and 20 frames. It has
    11,170,240 parameters; the paper states 11.2 M. Other than there: the first convolution has one
    channel, not three (6,272 weights fewer), and the weights start at random, not from ImageNet.
    The frames lie in the middle of n equal parts of the clip; the paper does not say which it took.

    Args:
        frames: n.
        width: channels of the first stage; 64 in ResNet-18.
    """

    takes: ClassVar[str] = "frames"
    recurrent: ClassVar[bool] = False
    note: ClassVar[str] = (
        "ResNet-18, temporal average pooling; trained from scratch, paper: ImageNet weights"
    )

    def __init__(self, *, frames: int = 10, width: int = 64) -> None:
        super().__init__()
        if frames < 1:
            raise InputError(f"the clips have {frames} frames", fix="give at least 1")
        self.frames = frames
        self.trunk = ResNet18(channels=1, width=width)
        self.dimension = self.trunk.width

    def forward(self, x: Tensor) -> Tensor:
        """Embeds clips (batch, 1, time, height, width) as (batch, dimension). (batch,
        dimension)."""
        images = _select_frames(x, self.frames)
        return self.trunk(images).mean(dim=(2, 3)).unflatten(0, (-1, self.frames)).mean(dim=1)


class Cardona(nn.Module):
    """ResNet-18 and an LSTM of two layers of 1000 units over 30 frames, its last state: (batch,
    1000).

    Cardona, Howland and Dabiri, Seeing the Wind, NeurIPS 2019, figure 2: ImageNet's ResNet-18
    describes each frame, a many-to-one LSTM of two layers with 1000 hidden units reads the
    descriptions. It has 41,618,240 parameters; Runia et al. state 42.1 M. What a description is, is
    inferred from that number: with the last map pooled to 3×3 fields (4,608 numbers a frame), three
    channels and ResNet-18's 513,000 weights of classes, used or not, it is 42.14 M; with the usual
    average over the whole map it would be 25.2 M. Other than there: one channel, no classes, random
    initial weights, all of them trained together, and frames at the rate of the clip.

    Args:
        frames: read in sequence.
        hidden: units of each of the two layers.
        grid: fields along each side over which the last map is averaged.
        width: channels of the first stage; 64 in ResNet-18.
    """

    takes: ClassVar[str] = "frames"
    recurrent: ClassVar[bool] = True
    note: ClassVar[str] = (
        "ResNet-18 + LSTM after Cardona et al. 2019; trained from scratch, paper: ImageNet weights"
    )

    def __init__(
        self, *, frames: int = 30, hidden: int = 1000, grid: int = 3, width: int = 64
    ) -> None:
        super().__init__()
        if min(frames, hidden, grid) < 1:
            raise InputError(
                f"the network has {frames} frames, {hidden} units and the grid {grid}",
                fix="give at least 1 of each",
            )
        self.frames = frames
        self.dimension = hidden
        self.trunk = ResNet18(channels=1, width=width)
        self.pool = nn.AdaptiveAvgPool2d(grid)
        self.memory = nn.LSTM(self.trunk.width * grid**2, hidden, num_layers=2, batch_first=True)

    def forward(self, x: Tensor) -> Tensor:
        """Embeds clips (batch, 1, time, height, width) as (batch, dimension). (batch,
        dimension)."""
        descriptions = self.pool(self.trunk(_select_frames(x, self.frames))).flatten(1)
        states, _ = self.memory(descriptions.unflatten(0, (-1, self.frames)))
        return states[:, -1]


class Yang(nn.Module):
    """A CNN like AlexNet and an LSTM of 256 units over 10 frames, its last state: (batch, 256).

    Yang, Liang and Lin, Learning-based Cloth Material Recovery from Video, ICCV 2017: a
    convolutional network and an LSTM, by their own account inspired by the LRCN of Donahue et al.
    (CVPR 2015), whose CNN is like AlexNet and whose LSTM reads its sixth layer with 256 units; they
    classify materials. Their own widths could not be looked up. It has 44,666,688 parameters; Runia
    et al. state none for it. Other than there: widths of the convolutions by Krizhevsky (One weird
    trick, 2014) in one tower, one channel, batch normalisation in place of local response
    normalisation and of dropout (random initial weights then learn at the common learning rate, and
    training draws no random numbers), random initial weights, and a regression of wind and material
    in place of classes. Images of 112×112 have a last map of 2×2, which the grid of 6×6
    repeats: the published size is kept, not the published detail.

    Args:
        frames: read in sequence.
        hidden: units of the LSTM.
        grid: fields along each side over which the last map is averaged before the sixth layer; 6
            in AlexNet.
        features: width of the sixth layer; 4096 in AlexNet.
    """

    takes: ClassVar[str] = "frames"
    recurrent: ClassVar[bool] = True
    note: ClassVar[str] = (
        "AlexNet-like CNN + LSTM after Yang et al. 2017; trained from scratch, batch normalisation"
    )

    def __init__(
        self, *, frames: int = 10, hidden: int = 256, grid: int = 6, features: int = 4096
    ) -> None:
        super().__init__()
        if min(frames, hidden, grid, features) < 1:
            raise InputError(
                f"the network has {frames} frames, {hidden} units, the grid {grid} and {features} "
                "features",
                fix="give at least 1 of each",
            )
        self.frames = frames
        self.dimension = hidden
        self.convolutions = nn.Sequential(
            *_convolution(1, 64, size=11, stride=4, padding=2),
            nn.MaxPool2d(3, stride=2),
            *_convolution(64, 192, size=5, stride=1, padding=2),
            nn.MaxPool2d(3, stride=2, padding=1),
            *_convolution(192, 384, size=3, stride=1, padding=1),
            *_convolution(384, 256, size=3, stride=1, padding=1),
            *_convolution(256, 256, size=3, stride=1, padding=1),
            nn.AdaptiveAvgPool2d(grid),
        )
        self.sixth = nn.Sequential(nn.Linear(256 * grid**2, features), nn.ReLU(inplace=True))
        self.memory = nn.LSTM(features, hidden, batch_first=True)
        initialise(self)

    def forward(self, x: Tensor) -> Tensor:
        """Embeds clips (batch, 1, time, height, width) as (batch, dimension). (batch,
        dimension)."""
        features = self.sixth(self.convolutions(_select_frames(x, self.frames)).flatten(1))
        states, _ = self.memory(features.unflatten(0, (-1, self.frames)))
        return states[:, -1]


def _convolution(
    inputs: int, width: int, *, size: int, stride: int, padding: int
) -> list[nn.Module]:
    """Returns a convolution, its batch normalisation and rectification."""
    return [
        nn.Conv2d(inputs, width, size, stride=stride, padding=padding, bias=False),
        nn.BatchNorm2d(width),
        nn.ReLU(inplace=True),
    ]
