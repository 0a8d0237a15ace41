"""Residual blocks and the trunk of ResNet-18, with random initial weights.

He et al., Deep Residual Learning for Image Recognition, CVPR 2016, figures 2 and 5 and table 1;
initial weights by He et al., Delving Deep into Rectifiers, ICCV 2015, equation 10.
"""

from __future__ import annotations

from torch import Tensor, nn

from flagdata.errors import InputError


def initialise(module: nn.Module) -> None:
    """Draws the weights of all convolutions from N(0, 2/fan_out) with torch's own generator;
    normalisations start at 1.

    Fan-out keeps the variance of the gradients from layer to layer (He et al. 2015, section 2.2,
    backward case). Weights without memory (`torch.device("meta")`) are left as they are: there is
    nothing to draw, and drawing it would load torch's compiler, which takes as long as torch
    itself.
    """
    for layer in module.modules():
        if isinstance(layer, nn.Conv2d) and not layer.weight.is_meta:
            nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")
        elif isinstance(layer, nn.BatchNorm2d):
            nn.init.ones_(layer.weight)
            nn.init.zeros_(layer.bias)


class BasicBlock(nn.Module):
    """Two 3×3 convolutions with batch normalisation, added to their input: (n, inputs, h, w) → (n,
    width, h/s, w/s).

    Where width or size change, the short cut is a 1×1 convolution with the same stride (option B of
    the paper).

    Args:
        inputs: channels that come in.
        width: channels that go out.
        stride: s, of the first convolution and of the short cut.
    """

    def __init__(self, *, inputs: int, width: int, stride: int) -> None:
        super().__init__()
        self.residual = nn.Sequential(
            nn.Conv2d(inputs, width, 3, stride=stride, padding=1, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            nn.Conv2d(width, width, 3, padding=1, bias=False),
            nn.BatchNorm2d(width),
        )
        self.shortcut = (
            nn.Identity()
            if stride == 1 and inputs == width
            else nn.Sequential(
                nn.Conv2d(inputs, width, 1, stride=stride, bias=False), nn.BatchNorm2d(width)
            )
        )

    def forward(self, x: Tensor) -> Tensor:
        """Returns max(0, residual(x) + shortcut(x)): (n, width, ⌈h/s⌉, ⌈w/s⌉)."""
        return (self.residual(x) + self.shortcut(x)).relu_()


class ResNet18(nn.Module):
    """The trunk of ResNet-18 without its pooling and classes: (n, channels, h, w) → (n, 8·width,
    ⌈h/32⌉, ⌈w/32⌉).

    With three channels and a width of 64 it has 11,176,512 parameters, as published (11.69 M with
    1000 classes).

    Args:
        channels: of the images; 1 for gray.
        width: channels of the first stage.

    Raises:
        InputError: no channels or no width.
    """

    def __init__(self, *, channels: int = 1, width: int = 64) -> None:
        super().__init__()
        if channels < 1 or width < 1:
            raise InputError(
                f"the ResNet-18 has {channels} channels and the width {width}",
                fix="give at least 1 of each",
            )
        layers: list[nn.Module] = [
            nn.Conv2d(channels, width, 7, stride=2, padding=3, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            nn.MaxPool2d(3, stride=2, padding=1),
        ]
        inputs = width
        for stage in range(4):
            outputs = width * 2**stage
            layers.append(BasicBlock(inputs=inputs, width=outputs, stride=1 if stage == 0 else 2))
            layers.append(BasicBlock(inputs=outputs, width=outputs, stride=1))
            inputs = outputs
        self.width = inputs
        self.layers = nn.Sequential(*layers)
        initialise(self)

    def forward(self, images: Tensor) -> Tensor:
        """Returns the last feature maps, before any pooling."""
        return self.layers(images)
