"""What a window of a film shows that has a unit and that a person could check with a ruler and a
stopwatch.

Each observable is one file with two definitions: on pixels (`FilmWindow`) and on geometry seen from
the same place (`ClothWindow`). An entry of `OBSERVABLES` enrols it in the contract suite
(`tests/measure/observables/test_contract.py`), in the table that `flagdata observe` writes and in
the power map.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from measure.observables.film_window import FilmWindow
from measure.observables.observable import Observable, UnseenError, WindowReading
from measure.observables.observables_by_name import OBSERVABLES
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

__getattr__ = lazy_exports(__name__, __file__)
