"""Effects from files: `FILE.py:Class`, asked for by name and loaded nowhere else."""

from __future__ import annotations

import sys
from dataclasses import is_dataclass
from pathlib import Path
from types import ModuleType

from flagdata.core.files.addresses import local_path
from flagdata.core.files.plain_text import plain_text
from flagdata.core.files.regular_files import check_input
from flagdata.core.provenance import file_hash
from flagdata.errors import NotFoundError, UsageError
from flagdata.packages.installed_names import rename_packages, renaming
from sim.effects.effect import Effect


def load(spec: str) -> type[Effect]:
    """Loads the effect class that `FILE.py:Class` names. The file is run as a module named after
    its content.

    Raises:
        UsageError: not of that form, a file that cannot be run, or a class that is no effect.
        NotFoundError: no such file or class.
    """
    text, _, attribute = spec.rpartition(":")
    if not text or not attribute.isidentifier():
        raise UsageError(f"{spec!r} names no effect", where="effect file", fix="give FILE.py:Class")
    path = local_path(text)
    check_input(path)
    module = _module(path)
    effect = getattr(module, attribute, None)
    if effect is None:
        raise NotFoundError(
            f"the file has no class {attribute!r}",
            where=text,
            fix="give the name of the effect's class",
        )
    if not (
        isinstance(effect, type)
        and issubclass(effect, Effect)
        and is_dataclass(effect)
        and effect.strengths()
    ):
        raise UsageError(
            f"{attribute!r} is no effect with a strength",
            where=text,
            fix="derive a frozen dataclass from a kind of effect in flagdata.extend, with an "
            "annotated strength",
        )
    return effect


def _module(path: Path) -> object:
    name = f"flagdata_effect_file_{file_hash(path)}"
    if name in sys.modules:
        return sys.modules[name]
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    try:
        source = plain_text(path.read_bytes(), noun="file of an effect", where=str(path))
        if renaming():  # the file imports sim as in a checkout
            source = rename_packages(source, path.parent)
        exec(compile(source, str(path), "exec"), vars(module))
    except Exception as error:
        del sys.modules[name]
        raise UsageError(
            f"it cannot be run: {error}", where=str(path), fix="correct the file"
        ) from error
    return module
