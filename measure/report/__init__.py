"""The verdict in sentences, as a page, as words for a terminal and as JSON.

It may import `measure.verdict`, and the outcomes of `measure.loop` and of the stages before it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.report.document import as_document, from_document
    from measure.report.lead_sentences import lead
    from measure.report.verdict_answer import answer_of_markers
    from measure.report.verdict_statement import by_draw, with_sentences

__getattr__ = lazy_exports(__name__, __file__)
