"""What the paper printed of its models on FlagSim, quoted to stand beside ours: it is not an aim to
tune to.

Runia et al., Cloth in the Wind, CVPR 2020: the supplement's table of wind speeds on FlagSim (0 to
10 m/s, 3,500 clips), and section 6's triplet accuracies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from models.evaluation.scores import rmse_bound


@dataclass(frozen=True, kw_only=True)
class Quoted:
    """A row of the paper's table: its input (frames × height × width), RMSE and Acc@0.5 as
    printed."""

    JSON_NAMES: ClassVar = ("model", "input_size", "rmse", "accuracy", "bound", "breaks_bound")

    model: str
    input_size: str
    rmse: float
    accuracy: float

    @property
    def bound(self) -> float:
        """The least RMSE [m/s] that its accuracy admits."""
        return rmse_bound(self.accuracy)

    @property
    def breaks_bound(self) -> bool:
        return self.rmse < self.bound


FLAGSIM = (
    Quoted(model="Yang et al.", input_size="10 × 227 × 227", rmse=0.380, accuracy=0.620),
    Quoted(model="Cardona et al.", input_size="30 × 227 × 227", rmse=0.271, accuracy=0.580),
    Quoted(model="ResNet-18", input_size="1 × 224 × 224", rmse=0.381, accuracy=0.615),
    Quoted(model="ResNet-18", input_size="10 × 224 × 224", rmse=0.264, accuracy=0.734),
    Quoted(model="ResNet-18", input_size="20 × 224 × 224", rmse=0.207, accuracy=0.775),
    Quoted(model="SDN", input_size="20 × 224 × 224", rmse=0.183, accuracy=0.813),
    Quoted(model="SDN", input_size="30 × 224 × 224", rmse=0.180, accuracy=0.838),
)
TRIPLETS = ((10, 0.893), (20, 0.921), (30, 0.963), (40, 0.901), (50, 0.924))
"""(frames, triplet accuracy) of the paper's SDN."""
WARNING = (
    "If a share 1 − A of the errors exceeds 0.5 m/s, then RMSE ≥ 0.5 √(1 − A) m/s. Four rows of "
    "the paper's table "
    "break this bound, so its two columns cannot be in the same units. They are quoted, not "
    "compared with."
)
