"""What a verdict is: its record of plain values, the thresholds it depends on, and how its
quantities are written.

It imports no other stage of a verdict, and any may import it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.verdict.criteria import CRITERIA
    from measure.verdict.decided import NOT_REJECTED, erring, undecided_sentences
    from measure.verdict.quantity import (
        display,
        estimate_text,
        in_errors,
        number,
        probability,
        share,
        with_error,
        with_level,
    )
    from measure.verdict.verdict_record import (
        QUANTITY_ENTRIES,
        Candidate,
        Comparison,
        Conclusion,
        NullTest,
        Parameter,
        Power,
        Residual,
        Verdict,
    )

__getattr__ = lazy_exports(__name__, __file__)
