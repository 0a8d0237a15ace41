"""What the effects of a verdict are called in sentences."""

from __future__ import annotations

from measure.loop.verdict import Verdict


def titles(verdict: Verdict) -> tuple[str, ...]:
    """What the verdict names, in its order; an effect of which several parameters were weighed with its parameter."""
    found: list[str] = []
    for name in verdict.named:
        own = [c for c in verdict.ranking if c.effect == name]
        acting = [c for c in own if not c.why_not]
        found += [title(c.effect, c.parameter) for c in acting] if acting and len(own) > 1 else [name]
    return tuple(found)


def title(effect: str, parameter: str) -> str:
    """An effect by one of its parameters."""
    return f"{effect} ({readable(parameter)})"


def readable(name: str) -> str:
    """A parameter's name as it is written in a sentence."""
    return name.replace("_", " ")
