"""The machine finds each defect that a lake had."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.stateful import run_state_machine_as_test

from tests.flagdata.lake.seeded_bugs import BUGS
from tests.flagdata.lake.test_state_machine import LakeMachine, machine_of

pytestmark = pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")
EXAMPLES = 40
STEPS = 12


def try_machine(machine: type[LakeMachine], *, examples: int, number: int) -> None:
    """Run a machine on drawn operations.

    Raises:
        AssertionError, FlagdataError: as it finds something.
    """
    drawn = settings(
        max_examples=examples,
        stateful_step_count=STEPS,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    run_state_machine_as_test(seed(number)(machine), settings=drawn)


@pytest.mark.parametrize("name", BUGS)
def test_the_machine_finds_a_seeded_bug(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bug = BUGS[name]
    bug.put(monkeypatch)
    with pytest.raises((AssertionError, Exception)) as found:
        try_machine(machine_of(bug.among), examples=EXAMPLES, number=bug.seed)
    assert found.value is not None
