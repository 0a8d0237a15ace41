"""A proposal as an effect: a module like those of the library, its contract tests, and what is
needed to install it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from flagdata.core.files.outputs import check_files, write_files
from flagdata.errors import ConflictError, UsageError
from measure.propose.outcome import ProposalOutcome, TermStrength
from measure.propose.terms import MASS, Term, TermColumn

_PROJECT = "pyproject.toml"
_COMMAND = "propose"


@dataclass(frozen=True, kw_only=True)
class EffectFile:
    """Where a proposal was written.

    Attributes:
        path: of the module.
        class_name: of the effect.
    """

    path: Path
    class_name: str

    @property
    def spec(self) -> str:
        """As `sim.effects.effect_files.load` takes it."""
        return f"{self.path}:{self.class_name}"


def write(outcome: ProposalOutcome, folder: Path) -> EffectFile:
    """Writes the effect file, its contract tests and its pyproject.toml, into a folder.

    An earlier proposal from the same data that was changed since is kept; the new one gets the next
    free name.

    Raises:
        UsageError: an outcome without terms of the dictionary.
        ConflictError: pyproject.toml is there and was not written by a proposal, or was changed
            since.
    """
    parts = [_part(strength) for strength in outcome.strengths]
    if not parts:
        raise UsageError("no term was taken", where="proposal", fix="write only what was proposed")
    short = outcome.proposed_from[:12]
    class_name = "".join(word.capitalize() for part in parts for word in part["name"].split("_"))
    module = next(name for name in _names(f"proposed_{short}") if _is_free(folder, name))
    forces, masses = [p for p in parts if not p["mass"]], [p for p in parts if p["mass"]]
    pieces = (
        (("FieldEffect",) if forces else ())
        + (("Flat",) if masses else ())
        + (("Seen",) if forces else ())
    )
    values: Mapping[str, Any] = {
        "forces": forces,
        "masses": masses,
        "pieces": ", ".join([*pieces, *(["heavier"] if masses else [])]),
        "title": _sentence([s.words for s in outcome.strengths]),
        "data": outcome.proposed_from,
        "strengths": parts,
        "class_name": class_name,
        "module": module,
        "name": module.replace("_", "-"),
        "source": f"from zero to the fit and its interval beyond; fitted to data {short}",
    }
    environment = Environment(
        loader=PackageLoader("measure.propose", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    templates = {
        f"{module}.py": "effect.py.j2",
        f"test_{module}.py": "test_effect.py.j2",
        _PROJECT: "pyproject.toml.j2",
    }
    texts = {
        name: environment.get_template(template).render(**values)
        for name, template in templates.items()
    }
    write_files(folder, texts, command=_COMMAND)
    return EffectFile(path=folder / f"{module}.py", class_name=class_name)


def check(folder: Path) -> None:
    """Refuses a folder in which `write` cannot write, before any term is sought; raises as
    `write`."""
    check_files(folder, _PROJECT, command=_COMMAND)


def _names(first: str) -> Iterator[str]:
    yield first
    yield from (f"{first}_{number}" for number in count(2))


def _is_free(folder: Path, module: str) -> bool:
    try:
        check_files(folder, f"{module}.py", f"test_{module}.py", command=_COMMAND)
    except ConflictError:
        return False
    return True


def _part(strength: TermStrength) -> dict[str, Any]:
    """Returns what the template needs of a strength whose name is `field_shape`."""
    term, estimate = Term.named(strength.name), strength.estimate
    reach = abs(estimate.high - estimate.low)
    least, _ = TermColumn.of(term).described.admissible
    prior = (max(least, min(0.0, estimate.point - reach)), max(0.0, estimate.point + reach))
    return {
        "name": strength.name,
        "field": term.field,
        "shape": term.at.code,
        "mass": term.field == MASS,
        "unit": estimate.unit,
        "words": strength.words,
        "value": f"{estimate.point:.6g}",
        "low": f"{estimate.low:.3g}",
        "high": f"{estimate.high:.3g}",
        "level": f"{100 * estimate.level:.0f} %",
        "prior": tuple(f"{v:#.4g}" for v in prior),
    }


def _sentence(words: Sequence[str]) -> str:
    text = "; ".join(words)
    return f"{text[0].upper()}{text[1:]}."
