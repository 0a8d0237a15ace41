"""Every effect, on the cloth or on a sensor, says of each parameter its unit, its null, its prior
and their source."""

from __future__ import annotations

from collections.abc import Iterator

from sim.effects import CLASSES, EFFECTS, SENSOR_EFFECTS, Effect, Need, Parametrised, Role


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


def test_every_effect_on_the_cloth_says_how_verdicts_weigh_it() -> None:
    offenders = [f"{name}: {what}" for name in EFFECTS for what in unsaid(EFFECTS[name])]
    assert offenders == []


def unsaid(effect: type[Effect]) -> Iterator[str]:
    """What is wrong with what an effect states of its weighing."""
    for label in effect.strengths():
        parameter = effect.parameters()[label]
        (low, high), step = parameter.weighed_range, parameter.small_step
        least, most = parameter.admissible
        if not least <= parameter.null + low < parameter.null + high <= most:
            yield f"{label}: weighs what is not admissible"
        if not low <= step <= high and not 0 < step < low:
            yield f"{label}: steps to where nothing is weighed"
    if effect.effect_class and effect.effect_class not in CLASSES:
        yield f"its class {effect.effect_class!r} has no title"
    if not all(isinstance(need, Need) and why for need, why in effect.needs.items()):
        yield "it needs something without saying why"


def test_every_class_has_several_effects() -> None:
    sizes = {
        name: sum(effect.effect_class == name for effect in EFFECTS.values()) for name in CLASSES
    }
    assert min(sizes.values()) >= 2, sizes
