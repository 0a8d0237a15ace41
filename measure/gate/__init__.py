"""Whether a clip is like what a model was trained on, and if not, why: asked before any interval is
shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.gate.clip_statistics import ClipStatistics
    from measure.gate.distortions import DISTORTIONS
    from measure.gate.gate import Gate
    from measure.gate.gate_file import read, write
    from measure.gate.gate_verdict import Reason, Verdict
    from measure.gate.reasons import REASONS
    from measure.gate.tail_probability import level
    from measure.gate.watch import FilmWatch
    from measure.gate.window import CheckedGate, FamiliarityGate, WindowGate, gate_of, judge

__getattr__ = lazy_exports(__name__, __file__)
