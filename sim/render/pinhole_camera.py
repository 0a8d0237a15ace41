"""A pinhole camera, and the one function from the world to pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Where the camera stands, which way it looks, and its intrinsics.

    Attributes:
        position: (3,) of the centre of projection [m].
        right, down, forward: (3,) unit vectors of its axes in the world: image x, image y, and the
            optical axis.
        focal: focal length [px].
        centre: where the optical axis meets the image [px].
        width, height: of the image [px].
    """

    position: tuple[float, float, float]
    right: tuple[float, float, float]
    down: tuple[float, float, float]
    forward: tuple[float, float, float]
    focal: float
    centre: tuple[float, float]
    width: int
    height: int

    @classmethod
    def looking(
        cls,
        *,
        position: tuple[float, float, float],
        target: tuple[float, float, float],
        view_angle: float,
        width: int,
        height: int,
        frame_offset: tuple[float, float] = (0.0, 0.0),
    ) -> Camera:
        """Places a level camera (its right axis is horizontal) that aims at a point.

        Args:
            view_angle: of the frame's longer side [rad].
            frame_offset: how far the picture is moved right and down, as shares of the longer side.

        Raises:
            InputError: it would look straight up or down, or stands where it aims.
        """
        forward = _minus(target, position)
        distance, across = math.hypot(*forward), math.hypot(forward[0], forward[1])
        if across <= 1e-6 * distance or distance == 0:
            raise InputError(
                f"a camera at {position} cannot look level at {target}",
                where="camera",
                fix="move it horizontally away from what it aims at",
            )
        ahead = (forward[0] / distance, forward[1] / distance, forward[2] / distance)
        right = (forward[1] / across, -forward[0] / across, 0.0)
        down = (
            ahead[1] * right[2] - ahead[2] * right[1],
            ahead[2] * right[0] - ahead[0] * right[2],
            ahead[0] * right[1] - ahead[1] * right[0],
        )
        longer = max(width, height)
        return cls(
            position=position,
            right=right,
            down=down,
            forward=ahead,
            width=width,
            height=height,
            focal=longer / 2 / math.tan(view_angle / 2),
            centre=(width / 2 + frame_offset[0] * longer, height / 2 + frame_offset[1] * longer),
        )

    def project(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Projects points in the world to image places and depths.

        Image x grows to the right and y downwards; (0, 0) is the upper left corner of the image,
        and pixel (i, j) has its centre at (j + 0.5, i + 0.5).

        Args:
            points: (…, 3) [m].

        Returns:
            places (…, 2) [px], and depths (…) along the optical axis [m]; places mean nothing where
                a depth is not
            positive.
        """
        axes = torch.tensor(
            [self.right, self.down, self.forward], dtype=points.dtype, device=points.device
        )
        relative = (points - points.new_tensor(self.position)) @ axes.T
        depth = relative[..., 2]
        places = relative[..., :2] * (self.focal / depth).unsqueeze(-1) + points.new_tensor(
            self.centre
        )
        return places, depth


def _minus(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> tuple[float, float, float]:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
