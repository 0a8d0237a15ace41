"""`flagdata blender-setup`: Blender's own environment."""

from __future__ import annotations

from pathlib import Path

from flagdata.core.console import LocalPath, document, echo, say
from flagdata.verbs.verb_options import AsJson, command, option, options


@options
class SettingUp(AsJson):
    """Where Blender's environment is made, and by which Python."""

    folder: Path | None = option(
        "Where the environment is made; by default the folder blender of flagdata's cache.",
        default=None,
        type=LocalPath(file_okay=False),
        metavar="DIR",
    )
    python: str | None = option(
        "A Python 3.11 to make it with; by default one that is found.",
        default=None,
        metavar="PYTHON",
    )
    check: bool = option("Only say which environment is used, and whether it works.", default=False)


@command(SettingUp)
def blender_setup(chosen: SettingUp) -> None:
    """Make the environment that the renderers cycles and workbench run in.

    Blender's module needs Python 3.11 and NumPy 1. It gets a virtual environment of its own, so
    that flagdata's is free of both. About 1 GB is downloaded and kept; pip's own settings apply.
    The command may be repeated: it completes what it began. A folder that holds anything else is
    refused, also a virtual environment made for other work.

    The environment in the default folder is found without further settings. For one elsewhere, set
    the variable FLAGDATA_BLENDER to the path of its Python.

    \b
      flagdata blender-setup
      flagdata blender-setup --check
      flagdata blender-setup --folder .venv-blender --python python3.11
    """
    from flagdata.errors import UsageError
    from sim.blender import environment

    folder, python = chosen.folder, chosen.python
    if chosen.check and (folder or python):
        raise UsageError(
            "--check looks at the environment that is used",
            where="flagdata blender-setup",
            fix="leave out --folder and --python",
        )
    if chosen.check:
        installed = environment.check(environment.find())
    else:
        installed = environment.create(
            folder or environment.default_folder(), python=python, say=say
        )
    content = {
        "python": str(installed.python),
        "blender": installed.blender,
        "numpy": installed.numpy,
    }
    if chosen.as_json:
        document("blender", {**content, "python_version": installed.python_version})
        return
    echo(
        f"Blender {installed.blender}, Python {installed.python_version}, NumPy {installed.numpy}: "
        f"{installed.python}"
    )
    if folder:
        say(f"set {environment.SETTING}={installed.python.absolute()} to have it used")
