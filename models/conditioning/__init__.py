"""A film made fit before anything is judged: camera steadied, flag found, cropped to it, all else
frozen.

`conditioned` does it to a short film in memory; `conditioning_of` and `Follower` are its two parts
for a film that is read as a stream.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from models.conditioning.conditioning import (
    Conditioned,
    Conditioning,
    Follower,
    condition_film,
    conditioning_of,
)

if TYPE_CHECKING:
    from models.conditioning.conditioning import (
        VERSION,
        Conditioning,
        Follower,
        condition_film,
        conditioning_of,
    )
    from models.conditioning.frame_interpolation import Interpolator, TimedFrame
    from models.conditioning.grain import add_grain
    from models.conditioning.mask_network import MaskNetwork, inputs_of
    from models.conditioning.outline import Outliner
    from models.conditioning.repeats import Distinct
    from models.conditioning.stills import HALVED, Stills, halve_picture


__all__ = ["Conditioned", "Conditioning", "Follower", "condition_film", "conditioning_of"]

__getattr__ = lazy_exports(__name__, __file__)
