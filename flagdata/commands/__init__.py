"""Commands of the command line, one file a topic; `flagdata.cli` names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.commands.durations import DURATION
    from flagdata.commands.sections import LongCommand
    from flagdata.commands.statements import STATED

__getattr__ = lazy_exports(__name__, __file__)
