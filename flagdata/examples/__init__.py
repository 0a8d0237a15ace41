"""Films of simulated flags and the logs beside them, which come with the package, with the truth of
each.

A folder each, with a film, a log, and `example.toml`, which states the flag, the clocks and what
was simulated. `python -m tests.studies example` makes them from their seeds.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.arguments import check_arguments
from flagdata.core.files.addresses import local_path
from flagdata.core.html import table
from flagdata.errors import NotFoundError, UnknownNameError

PREFIX = "example:"
"""Before the name of an example, where a film is named by a text."""
_HERE = Path(__file__).parent
_ABOUT = "example.toml"


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Example:
    """A film of a simulated flag with the log of a wind, and what was simulated.

    Attributes:
        name: of the example.
        title: what it is.
        film: video file.
        log: of the anemometer, on a clock of its own.
        flag_size: length and height of the flag [m].
        clock_offset: what must be added to the film's clock to reach the log's [s].
        truth: what was simulated, by name, SI: "wind_speed" is the mean of the wind at the flag
            over the film [m/s], "area_weight" the cloth's area weight [kg/m²].
    """

    name: str
    title: str
    film: Path
    log: Path
    flag_size: tuple[float, float]
    clock_offset: float
    truth: Mapping[str, float]

    @property
    def source(self) -> str:
        """The text that names it on the command line and in calls."""
        return f"{PREFIX}{self.name}"

    def _rows(self) -> dict[str, str]:
        length, height = self.flag_size
        return {
            "film": self.film.name,
            "log": self.log.name,
            "flag": f"{length:g} m × {height:g} m",
            "true wind": f"{self.truth['wind_speed']:.2f} m/s, the mean over the film",
            "true area weight": f"{self.truth['area_weight']:.3f} kg/m²",
        }

    def __repr__(self) -> str:
        return (
            f"Example({self.title}; "
            + "; ".join(f"{name} {value}" for name, value in self._rows().items())
            + ")"
        )

    def _repr_html_(self) -> str:
        return table(self.title, self._rows())


def names() -> tuple[str, ...]:
    """Names of the examples that come with the package."""
    return tuple(sorted(path.parent.name for path in _HERE.glob(f"*/{_ABOUT}")))


@check_arguments
def example(name: str = "flag") -> Example:
    """Returns an example that comes with the package: a film of a simulated flag, the log beside
    it, and the truth.

    ```python
    flag = flagdata.example("flag")
    found = flagdata.measure(flag.film, flag_size=flag.flag_size)
    found.wind.interval, flag.truth["wind_speed"]  # m/s
    ```

    Args:
        name: of the example.

    Raises:
        UnknownNameError: no example of that name.
    """
    if name not in names():
        raise UnknownNameError.of("example", name, names())
    folder = _HERE / name
    about = tomllib.loads((folder / _ABOUT).read_text(encoding="utf-8"))
    length, height = about["flag-size"]
    return Example(
        name=name,
        title=about["title"],
        film=folder / about["film"],
        log=folder / about["log"],
        flag_size=(length, height),
        clock_offset=about["clock-offset"],
        truth=about["truth"],
    )


def example_of(source: Path | str) -> Example | None:
    """Finds the example that a text `example:NAME` names; None of any other.

    Raises:
        UnknownNameError: no example of that name.
    """
    text = str(source)
    return example(text.removeprefix(PREFIX)) if text.startswith(PREFIX) else None


def path_of(source: Path | str) -> Path:
    """Returns the path that a source names: the film of an example, or a file or folder, which need
    not exist.

    Raises:
        UnknownNameError: no example of that name.
        UsageError: an address, see `flagdata.core.files.addresses.local_path`.
    """
    named = example_of(source)
    return local_path(source) if named is None else named.film


def check_without_lake(*sources: Path | str) -> None:
    """Checks that sources are files or folders, where no lake was named that could have them.

    It needs no module that takes long to import, so that a mistyped path is reported at once.

    Raises:
        NotFoundError: one is neither.
    """
    for source in sources:
        if not path_of(source).exists():
            raise NotFoundError(
                f"there is no file {str(source)!r}, and no lake was named",
                fix="correct the path, or name the lake by --lake",
            )
