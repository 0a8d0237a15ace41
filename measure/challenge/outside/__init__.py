"""Effects that are not in the library, written for challenges alone: whoever fits must not know them.

They keep the library's contract (null value, frames of reference), which `tests/measure/challenge/test_outside.py`
holds.
"""

from __future__ import annotations

from flagdata.registry import Registry

OUTSIDE = Registry(
    "effect outside the library",
    {
        "vortex-street": "measure.challenge.outside.vortex_street:VortexStreet",
        "attraction": "measure.challenge.outside.attraction:Attraction",
        "seam": "measure.challenge.outside.seam:Seam",
        "updraft": "measure.challenge.outside.updraft:Updraft",
        "passing-obstacle": "measure.challenge.outside.passing_obstacle:PassingObstacle",
        "button": "measure.challenge.outside.button:Button",
        "weft-friction": "measure.challenge.outside.weft_friction:WeftFriction",
        "turning-pole": "measure.challenge.outside.turning_pole:TurningPole",
        "tether": "measure.challenge.outside.tether:Tether",
        "one-sided": "measure.challenge.outside.one_sided:OneSided",
    },
)
