"""The observables by name. An entry here enrols one in the contract suite, in the table that
`flagdata observe` writes and in the power map.
"""

from __future__ import annotations

from flagdata.recipes.registry import Registry

OBSERVABLES = Registry(
    "observable",
    {
        "droop": "measure.observables.droop:DROOP",
        "extension": "measure.observables.extension:EXTENSION",
        "middle-speed": "measure.observables.middle_speed:MIDDLE_SPEED",
        "outline-speed": "measure.observables.outline_speed:OUTLINE_SPEED",
        "frequency": "measure.observables.frequency:FREQUENCY",
        "bandwidth": "measure.observables.frequency:BANDWIDTH",
        "amplitude-up": "measure.observables.amplitude_up:AMPLITUDE_UP",
        "amplitude-across": "measure.observables.amplitude_across:AMPLITUDE_ACROSS",
        "wave-speed": "measure.observables.wave_speed:WAVE_SPEED",
        "wave-length": "measure.observables.wave_length:WAVE_LENGTH",
        "area": "measure.observables.area:AREA",
        "asymmetry": "measure.observables.asymmetry:ASYMMETRY",
        "hoist-bulge": "measure.observables.hoist_bulge:HOIST_BULGE",
    },
)
"""Name → `Observable`."""
