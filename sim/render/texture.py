"""A texture and its halvings, in one array, read at any place and fineness."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from flagdata.core.arrays import UInt8Array
from sim.render.develop import to_linear


@dataclass(frozen=True, kw_only=True, eq=False)
class Pyramid:
    """Levels 0, 1, … each half as wide and high as the last, down to 1 texel on the shorter side.

    Attributes:
        texels: (all texels, 3) float32 linear, level after level, row after row, upper row first.
        width, height, start: (level,) int64 size of each level and place of its first texel.
    """

    texels: Tensor
    width: Tensor
    height: Tensor
    start: Tensor

    @classmethod
    def of(cls, image: UInt8Array, *, device: torch.device) -> Pyramid:
        """Makes the pyramid of an sRGB image (height, width, 3); halved in linear light, odd last
        rows and columns dropped."""
        levels = [torch.from_numpy(to_linear(image)).to(device)]
        while min(levels[-1].shape[:2]) > 1:
            level = levels[-1]
            rows, columns = (n // 2 for n in level.shape[:2])
            levels.append(
                level[: 2 * rows, : 2 * columns]
                .unflatten(0, (rows, 2))
                .unflatten(2, (columns, 2))
                .mean((1, 3))
            )
        sizes = [level.shape[0] * level.shape[1] for level in levels]
        return cls(
            texels=torch.cat([level.flatten(0, 1) for level in levels]).contiguous(),
            width=torch.tensor([level.shape[1] for level in levels], device=device),
            height=torch.tensor([level.shape[0] for level in levels], device=device),
            start=torch.tensor([sum(sizes[:i]) for i in range(len(sizes))], device=device),
        )

    @cached_property
    def padded(self) -> Tensor:
        """(all texels, 4) the texels with a fourth value, 0."""
        return torch.nn.functional.pad(self.texels, (0, 1))

    def __len__(self) -> int:
        return len(self.start)

    def level(self, uv_area: Tensor, pixel_area: Tensor, samples: int) -> Tensor:
        """Selects the level whose texels are about as large as the distance of a pixel's samples.

        Args:
            uv_area: share of the texture that a face takes.
            pixel_area: what it takes in the image [px²].
            samples: of a pixel.

        Returns:
            int64, same shape.
        """
        texels = uv_area * float(self.width[0] * self.height[0])
        spacing = (texels / (pixel_area * samples).clamp_min(1e-6)).clamp_min(1e-12)
        return (0.5 * spacing.log2() + 0.5).round().long().clamp(0, len(self) - 1)

    def at(self, uv: Tensor, level: Tensor) -> Tensor:
        """Interpolates linear colours (point, 3) at texture places (point, 2), bilinear within a
        level; edges are continued."""
        width, height, start = self.width[level], self.height[level], self.start[level]
        x = (uv[:, 0] * width - 0.5).clamp_min(0.0)
        y = ((1 - uv[:, 1]) * height - 0.5).clamp_min(0.0)
        left, top = torch.minimum(x.long(), width - 1), torch.minimum(y.long(), height - 1)
        right, bottom = torch.minimum(left + 1, width - 1), torch.minimum(top + 1, height - 1)
        s, t = ((p - q).clamp_max(1.0).unsqueeze(1) for p, q in ((x, left), (y, top)))
        upper = (
            self.texels[start + top * width + left] * (1 - s)
            + self.texels[start + top * width + right] * s
        )
        lower = (
            self.texels[start + bottom * width + left] * (1 - s)
            + self.texels[start + bottom * width + right] * s
        )
        return upper * (1 - t) + lower * t
