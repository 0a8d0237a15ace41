"""Every effect, on the cloth or on a sensor, says of each parameter its unit, its null, its prior
and their source."""

from __future__ import annotations

from collections.abc import Iterator

from sim.effects import EFFECTS, SENSOR_EFFECTS, Parametrised, Role


def test_every_parameter_has_unit_null_prior_and_source() -> None:
    offenders = [
        f"{name}: {what}"
        for table in (EFFECTS, SENSOR_EFFECTS)
        for name in sorted(table)
        for what in lacking(table[name])
    ]
    assert offenders == []


def lacking(effect: type[Parametrised]) -> Iterator[str]:
    """What an effect does not say of itself or of one of its parameters."""
    described, parameters = effect.__doc__ or "", effect.parameters()
    if not any(p.role is Role.STRENGTH for p in parameters.values()) or not effect.strengths():
        yield "a strength"
    for label, parameter in parameters.items():
        least, most = parameter.admissible
        low, high = parameter.prior
        for what, stated in {
            "unit": parameter.unit,
            "prior within what is admissible": least <= low < high <= most,
            "null that is admissible": least <= parameter.null <= most,
            "source": len(parameter.source) > 20,
            "description in the docstring": f"{label}:" in described,
        }.items():
            if not stated:
                yield f"{label}: {what}"
