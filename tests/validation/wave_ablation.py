"""What each kind of wave map adds to the network `wave` (`tests.validation.maps_ablation`)."""

from __future__ import annotations

from models.frontend import WAVE_CHANNELS
from tests.validation.maps_ablation import Ablation

ABLATION = Ablation(
    name="wave",
    known=WAVE_CHANNELS,
    kinds={
        "second peak": ("peak 2",),
        "shape of the spectrum": ("log power", "centre", "width", "band"),
        "phase gradient": ("phase gradient", "coherence"),
        "picture at rest": ("mean picture", "log of its slope", "log standard deviation"),
    },
    least=("first peak alone", ("peak 1",)),
)
run = ABLATION.run
