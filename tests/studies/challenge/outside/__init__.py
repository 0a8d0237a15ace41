"""Effects that are not in the library, written for challenges alone: the fit must not know them.

They keep the library's contract (null value, frames of reference), which
`tests/studies/challenge/test_outside.py` holds.
"""

from __future__ import annotations

from flagdata.recipes.registry import Registry

OUTSIDE = Registry(
    "effect outside the library",
    {
        "vortex-street": "tests.studies.challenge.outside.vortex_street:VortexStreet",
        "attraction": "tests.studies.challenge.outside.attraction:Attraction",
        "seam": "tests.studies.challenge.outside.seam:Seam",
        "updraft": "tests.studies.challenge.outside.updraft:Updraft",
        "passing-obstacle": "tests.studies.challenge.outside.passing_obstacle:PassingObstacle",
        "button": "tests.studies.challenge.outside.button:Button",
        "weft-friction": "tests.studies.challenge.outside.weft_friction:WeftFriction",
        "turning-pole": "tests.studies.challenge.outside.turning_pole:TurningPole",
        "tether": "tests.studies.challenge.outside.tether:Tether",
        "one-sided": "tests.studies.challenge.outside.one_sided:OneSided",
        "sheltering-wall": "tests.studies.challenge.outside.sheltering_wall:ShelteringWall",
        "veer": "tests.studies.challenge.outside.veer:Veer",
        "whirl": "tests.studies.challenge.outside.whirl:Whirl",
        "swaying-pole": "tests.studies.challenge.outside.swaying_pole:SwayingPole",
        "spray": "tests.studies.challenge.outside.spray:Spray",
        "fringes": "tests.studies.challenge.outside.fringes:Fringes",
        "vent": "tests.studies.challenge.outside.vent:Vent",
        "neighbour": "tests.studies.challenge.outside.neighbour:Neighbour",
        "balloon": "tests.studies.challenge.outside.balloon:Balloon",
        "drawstring": "tests.studies.challenge.outside.drawstring:Drawstring",
    },
)
