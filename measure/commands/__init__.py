"""The verbs of measuring: what each option means, the parts that it asks in turn, what is printed
and written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.commands.close_loop import CloseLoopCommand
    from measure.commands.measurement_artifact import read

__getattr__ = lazy_exports(__name__, __file__)
