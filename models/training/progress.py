"""Progress of a training: losses by epoch, the best of them, and their curves as a picture."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Epoch:
    """Attributes:
    number: from 0.
    train, validation: mean losses.
    rate: learning rate at its end.
    seconds: that it took.
    clips: that were trained on.
    """

    number: int
    train: float
    validation: float
    rate: float
    seconds: float
    clips: int


_KINDS: dict[str, Callable[[Any], Any]] = {
    "number": int,
    "train": float,
    "validation": float,
    "rate": float,
    "seconds": float,
    "clips": int,
}


@dataclass(kw_only=True)
class LossCourse:
    """Attributes:
    epochs: that were completed.
    """

    epochs: list[Epoch] = field(default_factory=list)

    @property
    def best(self) -> Epoch | None:
        """The epoch with the smallest validation loss, the first of equals."""
        return min(self.epochs, key=lambda epoch: epoch.validation, default=None)

    def is_stalled(self, patience: int) -> bool:
        """Returns whether the last `patience` epochs were no better than the best before them."""
        best = self.best
        return best is not None and len(self.epochs) - 1 - best.number >= patience

    def as_list(self) -> list[dict[str, Any]]:
        return [asdict(epoch) for epoch in self.epochs]

    @classmethod
    def of(cls, content: list[dict[str, Any]]) -> LossCourse:
        """Rebuilds a course from `as_list`.

        Raises:
            AttributeError, KeyError, OverflowError, TypeError, ValueError: it is not from there.
        """
        return cls(
            epochs=[
                Epoch(**{name: _KINDS[name](value) for name, value in entry.items()})
                for entry in content
            ]
        )

    def picture(self) -> bytes:
        """Draws the losses and the learning rate against the epoch: a PNG."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 3.6), dpi=110, layout="constrained")
        axes = figure.subplots()
        numbers = [epoch.number + 1 for epoch in self.epochs]
        axes.plot(numbers, [epoch.train for epoch in self.epochs], label="training")
        axes.plot(numbers, [epoch.validation for epoch in self.epochs], label="validation")
        if (best := self.best) is not None:
            axes.plot(
                [best.number + 1],
                [best.validation],
                "o",
                color="C1",
                label=f"best, epoch {best.number + 1}",
            )
        axes.set_xlabel("epoch")
        axes.set_ylabel("loss")
        axes.grid(alpha=0.3)
        rates = axes.twinx()
        rates.plot(
            numbers, [epoch.rate for epoch in self.epochs], color="0.6", linewidth=1, linestyle=":"
        )
        rates.set_ylabel("learning rate (dotted)")
        axes.legend()
        out = io.BytesIO()
        figure.savefig(out, format="png")
        return out.getvalue()
