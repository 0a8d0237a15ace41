"""What each kind of flow map adds to the network `flow` (`tests.validation.maps_ablation`)."""

from __future__ import annotations

from models.flow import CHANNELS
from tests.validation.maps_ablation import Ablation

ABLATION = Ablation(
    name="flow",
    known=CHANNELS,
    kinds={
        "spectrum of the flow": ("centre", "width", "band"),
        "phase gradient": ("phase gradient", "coherence"),
        "what is to be seen": ("log slope", "mean picture", "log of its slope", "log standard deviation"),
        "the fine scale": ("fine: ",),
        "the coarse scale": ("coarse: ",),
    },
    least=("power alone", ("log power",)),
)
run = ABLATION.run
