"""`flagdata close-loop`: sources in; a verdict, its report, its models and what the lake keeps of
them out.

It composes the stages of a verdict and may import all of them: `measure.loop` finds the numbers,
`measure.report` the words.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.closing.answer_by_both import joint_answer
    from measure.closing.close import close_loop
    from measure.closing.joint_verdict import join_verdicts
    from measure.closing.model_recipes import acting
    from measure.closing.verdict_artifacts import ClosedLoop, answer_of
    from measure.closing.verdict_sources import SourceOptions

__getattr__ = lazy_exports(__name__, __file__)
