"""What a window of a film shows that has a unit and that a person could check with a ruler and a stopwatch.

Each observable is one file with two definitions: on pixels (`FilmWindow`) and on geometry seen from the same place
(`ClothWindow`). An entry here enrols it in the contract suite (`tests/measure/observables/test_contract.py`), in the
table that `flagdata observe` writes and in the power map.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.recipes.registry import Registry
from measure.observables.film_window import FilmWindow
from measure.observables.observable import Observable, UnseenError, WindowReading
from measure.observables.silhouettes import Silhouettes
from measure.observables.tracked_cloth import ClothWindow, View, seen_from

if TYPE_CHECKING:
    from measure.observables.film_window import FilmWindow
    from measure.observables.observable import WINDOW, Observable
    from measure.observables.observables_table import table_of
    from measure.observables.tracked_cloth import ClothWindow, View, edges_of, seen_from
    from measure.observables.watching import watch_film


__all__ = [
    "OBSERVABLES",
    "ClothWindow",
    "FilmWindow",
    "Observable",
    "Silhouettes",
    "UnseenError",
    "View",
    "WindowReading",
    "seen_from",
]

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

__getattr__ = lazy_exports(__name__, __file__)
