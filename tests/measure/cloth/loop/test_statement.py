"""What a verdict on films says beside its numbers."""

from __future__ import annotations

import pytest

from measure.cloth.films_statement import separating
from measure.verdict import Conclusion
from tests.measure.report.verdicts import verdict


@pytest.mark.parametrize("weighed", [False, True])
def test_a_cloth_that_was_weighed_is_not_to_be_weighed_again(weighed: bool) -> None:
    said = separating(verdict(Conclusion.ONE_OF), has_weight=weighed)
    assert said.startswith("a recording in another wind")
    assert ("--area-weight" in said) is not weighed
    assert separating(verdict(Conclusion.EFFECT), has_weight=weighed) == ""
