"""The kinds of sensor effects: what instruments do to an observation.

Pure functions on float64 tensors, batch innermost. Times are seconds since the start of a record:
over a day, float64 resolves 0.02 ns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import torch
from torch import Tensor

from flagdata.errors import InputError, UsageError
from sim.effects.parameter import Parametrised


class AnemometerEffect(Parametrised, ABC):
    """What an anemometer makes of the speed of the air."""

    @abstractmethod
    def read(self, time: Tensor, speed: Tensor) -> Tensor:
        """Computes readings (n, batch) [m/s].

        Args:
            time: (n,) increasing [s].
            speed: (n, batch) of the air at the sensor, or what an effect before made of it [m/s].
        """


class ClockEffect(Parametrised, ABC):
    """What a device's clock reads."""

    @abstractmethod
    def stamps(self, time: Tensor) -> Tensor:
        """Computes the clock's readings (n, batch) [s] at true times (n, batch) [s]."""


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """When a camera sees what: every pixel row of every frame averages the scene over some
    instants.

    Attributes:
        stamps: (frame,) the time each frame is stored with [s].
        instants: (frame, row, node, batch) when it is really seen [s]; any axis but the first may
            be 1.
        weights: (node,) of the average; their sum is 1.
        rows: (row,) height in the image, 0 at the top and 1 at the bottom, of each tracked point or
            pixel row.
    """

    stamps: Tensor
    instants: Tensor
    weights: Tensor
    rows: Tensor

    @classmethod
    def ideal(cls, stamps: Tensor, rows: Tensor) -> Sampling:
        """Frames (frame,) [s] that are taken at once when they say they are, of points at rows
        (row,)."""
        return cls(
            stamps=stamps,
            rows=rows,
            weights=stamps.new_ones(1),
            instants=stamps[:, None, None, None],
        )

    def observe(self, time: Tensor, trajectory: Tensor) -> Tensor:
        """Samples moving points as the camera does, linear between samples: (frame, row, 3, batch)
        [m].

        Args:
            time: (n,) increasing [s].
            trajectory: (n, row, 3, batch) [m].

        Raises:
            InputError: a trajectory that does not fit the times or rows.
            UsageError: an instant outside the trajectory.
        """
        n, rows, axes, batch = trajectory.shape
        if n != len(time) or rows != len(self.rows) or axes != 3:
            raise InputError(
                f"the trajectory has the shape {tuple(trajectory.shape)}, and there are "
                f"{len(time)} "
                f"times and {len(self.rows)} rows",
                where="camera",
                fix="give (time, row, 3, batch)",
            )
        first, last = (float(v) for v in torch.aminmax(self.instants.detach()))
        if not float(time[0]) <= first <= last <= float(time[-1]):
            raise UsageError(
                f"the camera sees from {first:g} to {last:g} s, the trajectory is known from "
                f"{float(time[0]):g} to "
                f"{float(time[-1]):g} s",
                where="camera",
                fix="simulate from an exposure before the first frame to one after the last",
            )
        instants = self.instants.expand(-1, rows, -1, batch)
        after = torch.searchsorted(time, instants.detach().contiguous(), right=True).clamp(1, n - 1)
        share = (instants - time[after - 1]) / (time[after] - time[after - 1])
        row = torch.arange(rows, device=time.device)[None, :, None, None]
        member = torch.arange(batch, device=time.device)
        # (frame, row, node, batch, 3): advanced indices come first.
        low, high = (trajectory.movedim(2, 3)[index, row, member] for index in (after - 1, after))
        sampled = torch.lerp(low, high, share.unsqueeze(-1)).movedim(-1, 2)
        base = sampled[:, :, :, 0]
        return base + ((sampled - base.unsqueeze(3)) * self.weights[:, None]).sum(3)


class CameraEffect(Parametrised, ABC):
    """What a camera does to the instants it sees."""

    @abstractmethod
    def change_instants(self, sampling: Sampling) -> Sampling:
        """Returns the changed instants."""
