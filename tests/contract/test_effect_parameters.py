"""Every effect, on the cloth or on a sensor, says of each parameter its unit, its null, its prior and their source."""

from __future__ import annotations

import pytest

from flagdata.registry import Registry
from sim.effects import EFFECTS, SENSOR_EFFECTS, Role


@pytest.mark.parametrize(
    ("table", "name"), [(table, name) for table in (EFFECTS, SENSOR_EFFECTS) for name in sorted(table)]
)
def test_every_parameter_has_unit_null_prior_and_source(table: Registry, name: str) -> None:
    effect = table[name]
    assert effect.__doc__
    assert effect.strengths()
    assert any(p.role is Role.STRENGTH for p in effect.parameters().values())
    for label, parameter in effect.parameters().items():
        least, most = parameter.admissible
        low, high = parameter.prior
        assert parameter.unit, label
        assert least <= low < high <= most, label
        assert least <= parameter.null <= most, label
        assert len(parameter.source) > 20, label
        assert f"{label}:" in effect.__doc__, f"{label} is not described in the docstring"
