"""Effects that are not in the library, written for challenges alone: the fit must not know them.

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
        "sheltering-wall": "measure.challenge.outside.sheltering_wall:ShelteringWall",
        "veer": "measure.challenge.outside.veer:Veer",
        "whirl": "measure.challenge.outside.whirl:Whirl",
        "swaying-pole": "measure.challenge.outside.swaying_pole:SwayingPole",
        "spray": "measure.challenge.outside.spray:Spray",
        "fringes": "measure.challenge.outside.fringes:Fringes",
        "vent": "measure.challenge.outside.vent:Vent",
        "neighbour": "measure.challenge.outside.neighbour:Neighbour",
        "balloon": "measure.challenge.outside.balloon:Balloon",
        "drawstring": "measure.challenge.outside.drawstring:Drawstring",
    },
)
