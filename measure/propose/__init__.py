"""Effects that the library lacks: proposed from what a model leaves of recordings, tested on
others, kept or not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.propose.effect_file import write
    from measure.propose.outcome import Decision, ProposalOutcome
    from measure.propose.term_search import made_ready
    from measure.propose.terms import Term, columns_of, dictionary

__getattr__ = lazy_exports(__name__, __file__)
