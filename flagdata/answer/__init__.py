"""What every question is answered by: quantities with their intervals, the same in terminal, Python
and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.answer.answer import Answer, Array, Figure, Gallery, Head, Section, Table, Tone
    from flagdata.answer.quantity import Bound, Quantity, Span

__getattr__ = lazy_exports(__name__, __file__)
