"""The film that is measured: which one it is, its frames made fit, its windows, and the size of its
flag."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.film.conditioned_film import ConditionedFilm
    from measure.film.film_source import FilmReading, Subject, subjects
    from measure.film.similarity import FlagSize, scaled_back, sizes
    from measure.film.windows import WindowLayout, WindowReader, findings_of

__getattr__ = lazy_exports(__name__, __file__)
