"""Progress of a training: losses by epoch, the best of them, and their curves as a chart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

from flagdata.answer.charts import Axis, Chart, Colour, Dots, Line, Mark, Panel


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

    def chart(self) -> Chart:
        """Shows the losses, and below them the learning rate, by the epoch."""
        numbers = [epoch.number + 1 for epoch in self.epochs]
        ticks = numbers[:: max(1, len(numbers) // 8)]
        marks: list[Mark] = [
            Line(
                x=numbers,
                y=[epoch.train for epoch in self.epochs],
                colour=Colour.QUIET,
                label="training",
            ),
            Line(x=numbers, y=[epoch.validation for epoch in self.epochs], label="validation"),
        ]
        if (best := self.best) is not None:
            label = f"best, epoch {best.number + 1}"
            marks.append(Dots(x=[best.number + 1], y=[best.validation], label=label, size=6.0))
        rate = Line(x=numbers, y=[epoch.rate for epoch in self.epochs], colour=Colour.QUIET)
        return Chart(
            rows=[
                [Panel(marks=marks, x=Axis(ticks=ticks), y=Axis(label="loss"))],
                [
                    Panel(
                        marks=[rate],
                        x=Axis(label="epoch", ticks=ticks),
                        y=Axis(label="learning rate"),
                    )
                ],
            ],
            heights=(2.8, 1.3),
            width=5.6,
        )
