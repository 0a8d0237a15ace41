"""One class states a verb's options: its command, its Python call and the recipe of its result
agree, and stay."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import pytest

import flagdata
from flagdata.api import lake_verbs, learning, measuring_verbs, recording_verbs
from flagdata.cli import VERBS, root
from flagdata.core.provenance import recipe_hash
from flagdata.errors import UsageError
from flagdata.verbs.option_types import DURATION
from flagdata.verbs.verb_options import (
    LongCommand,
    argument,
    command,
    described_fields,
    make_call,
    option,
    options,
    typed_names,
)

FORMS = {
    "align": recording_verbs.Aligning,
    "branch": lake_verbs.Naming,
    "build": learning.Building,
    "calibrate": measuring_verbs.Calibrating,
    "close_loop": measuring_verbs.Closing,
    "evaluate": learning.Evaluating,
    "export": lake_verbs.Exporting,
    "ingest": recording_verbs.Ingesting,
    "measure": measuring_verbs.Measuring,
    "observe": measuring_verbs.Observing,
    "query": lake_verbs.Querying,
    "realign": recording_verbs.Realigning,
    "tag": lake_verbs.Naming,
    "train": learning.Training,
}
OTHERWISE = {
    "calibrate": {"workers"},  # a notebook begins no processes of its own accord
    "close_loop": {
        "wind",
        "rest",
        "material",
        "attachment",
        "workers",
    },  # arrays state what sources on a disk know
}
"""Parameters of a call whose default is another one on the command line, or that are not there."""


def verb(name: str) -> click.Command:
    found = root.get_command(click.Context(root), name.replace("_", "-"))
    assert found is not None
    return found


@pytest.mark.parametrize("name", FORMS)
def test_a_call_takes_what_its_command_takes_with_the_same_defaults(name: str) -> None:
    of_call = inspect.signature(getattr(flagdata, name)).parameters
    assert set(of_call) == set(described_fields(FORMS[name]))
    of_command = {one.name: one for one in verb(name).params}
    wrong = {}
    for key, parameter in of_call.items():
        if key in OTHERWISE.get(name, ()) or parameter.default is inspect.Parameter.empty:
            continue
        there = of_command[key].get_default(click.Context(verb(name)))
        if (there or None) != (parameter.default or None):
            wrong[key] = (parameter.default, there)
    assert wrong == {}


OF_THE_TERMINAL = {"blender-setup", "completion", "demo", "help", "view"}
"""Commands that no call does: what they are about is a shell, a browser or an installation."""


def test_every_other_verb_is_a_call() -> None:
    assert {
        name for name in VERBS if name.replace("-", "_") not in flagdata.__all__
    } == OF_THE_TERMINAL


def typed_words(name: str, form: type, *words: str) -> Any:
    """The options of a command line."""
    return form(**verb(name).make_context(name, list(words)).params)


def called_with(place: str, call: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> Any:
    """The options that a call hands to what does it."""
    handed: list[Any] = []
    monkeypatch.setattr(place, lambda chosen: handed.append(chosen))
    call()
    return handed[0]


def test_a_measurement_is_asked_for_alike_and_keeps_its_recipe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from measure.commands.measure import MeasureCommand
    from measure.commands.measure_film import Request

    words = (
        "flag.mp4 --flag-size 1.5x1.0 --area-weight 0.19±0.01 --windows 1.2s --seed 3 --level 0.8 "
        "--end 3s"
    )
    of_command = typed_words("measure", MeasureCommand, *words.split(), "--crop", "10,10,240,240")
    of_call = called_with(
        "measure.commands.measure_film.measure_one",
        lambda: flagdata.measure(
            "flag.mp4",
            flag_size=(1.5, 1.0),
            area_weight="0.19±0.01",
            windows=1.2,
            seed=3,
            level=0.8,
            end=3.0,
            crop=(10, 10, 240, 240),
        ),
        monkeypatch,
    )
    for chosen in (of_command, of_call):
        request = Request.of(chosen, lake=None, at=None)
        assert {**request.options.recipe(), **request.reading.recipe()} == {
            "flag_size": [1.5, 1.0],
            "step": 1.2,
            "first": None,
            "last": 3.0,
            "level": 0.8,
            "false_alarm": 0.05,
            "refine": None,
            "area_weight": {"value": 0.19, "sigma": 0.01},
            "crop": "10,10,240,240",
            "flag": None,
            "true_fps": None,
            "sequence_fps": None,
        }
        assert request.options.seed == 3


def test_a_calibration_is_asked_for_alike_and_keeps_its_recipe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from measure.cloth import options_of
    from measure.commands import CloseLoopCommand
    from measure.commands.calibrate import CalibrateCommand
    from measure.film import FlagSize

    words = (
        "t.csv --flag-size 1.5x1.0 --azimuth 70±7 --elevation 3 --simulations 64 --seed 3 "
        "--material knit"
    )
    of_command = typed_words(
        "calibrate", CalibrateCommand, *words.split(), "--level", "0.8", "--attachment", "hoist"
    )
    of_films = typed_words("close-loop", CloseLoopCommand, *words.split(), "--attachment", "hoist")
    of_call = called_with(
        "measure.commands.calibrate_recordings.calibrate_recordings",
        lambda: flagdata.calibrate(
            "t.csv",
            flag_size=(1.5, 1.0),
            azimuth_deg="70±7",
            elevation_deg=3,
            simulations=64,
            seed=3,
            level=0.8,
            material="knit",
            attachment="hoist",
        ),
        monkeypatch,
    )
    for chosen in (of_command, of_films, of_call):
        size = FlagSize.of(chosen.flag_size)
        found = options_of(
            chosen, size, simulations=chosen.simulations, level=0.8, seed=chosen.seed
        )
        assert (
            recipe_hash(found.recipe())
            == "3f9483f81f16623aa2bbc93067e0ff7e58c50f9d1bbc46834cc4eb27cee09725"
        )
    assert of_command.level == of_call.level == 0.8


def test_an_ingest_is_asked_for_alike_and_keeps_its_recipes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from flagdata.commands.ingest import IngestCommand
    from flagdata.commands.ingest_options import IngestRequest
    from flagdata.ingest import UNASKED

    words = (
        "a.mp4 b.csv --rate 10 --archive h264 --crop 1,2,30,40 --start 2026-05-01T12:00:00Z --unit "
        "km/h"
    )
    of_command = typed_words(
        "ingest", IngestCommand, *words.split(), "--azimuth", "90", "--missing", "-99.9"
    )
    of_call = called_with(
        "flagdata.commands.ingest_sources.ingest_from_python",
        lambda: flagdata.ingest(
            ["a.mp4", Path("b.csv")],
            rate="10",
            archive="h264",
            crop="1,2,30,40",
            start="2026-05-01T12:00:00Z",
            unit="km/h",
            azimuth=90,
            missing=("-99.9",),
        ),
        monkeypatch,
    )
    for chosen in (of_command, of_call):
        given = IngestRequest.of(chosen, confirm=UNASKED)
        assert given.sources == (Path("a.mp4"), Path("b.csv"))
        assert (
            recipe_hash(given.camera.recipe())
            == "0865a8d1b241b73349372d493e34d8430681f7c6adea4966ca7dc67af043158e"
        )
        assert (
            recipe_hash(given.wind.recipe())
            == "ec606ac40db61fd876fbb82587158da201defaca1b29b73a5a0450999f589f6e"
        )


def test_an_alignment_is_asked_for_alike_and_keeps_its_recipe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from flagdata.commands.align import AlignCommand, Report

    of_command = typed_words(
        "align", AlignCommand, "film", "mast", "--search", "30", "--response", "0.5"
    )
    handed: list[Any] = []
    report = Report(tag="align", content={}, lines=())
    monkeypatch.setattr(
        "flagdata.commands.align.align_pair", lambda chosen: handed.append(chosen) or report
    )
    assert flagdata.align("film", "mast", search=30, response=0.5, lake="x") == {}
    for chosen in (of_command, handed[0]):
        assert (chosen.first, chosen.second) == ("film", "mast")
        assert (
            recipe_hash(chosen.clock().recipe())
            == "a2bd792e5668e1d33c047a46b31be994dc8b38d8d921b2fff4eb37dde8973f5f"
        )


@options
class Made:
    """Options of a verb that is made here."""

    source: str = argument("What is read.", "SOURCE")
    window: float = option(
        "Length of a window [s].", default=2.5, type=DURATION, section="The film"
    )
    names: tuple[str, ...] = option("Names.", "--name", default=())
    loud: bool = option("Whether it is said aloud.", default=False)

    def __post_init__(self) -> None:
        if self.window < 1:
            raise UsageError("the window is too short", where="--window", fix="give 1s or more")


def test_the_name_of_the_last_version_is_read_with_a_warning(
    capsys: pytest.CaptureFixture[str],
) -> None:
    taken: list[tuple[float, frozenset[str]]] = []

    @options
    class Renamed:
        """One option that had another name."""

        clock_offset: float = option("Seconds.", default=0.0, was=("--offset",))

    @command(Renamed)
    def shift(chosen: Renamed) -> None:
        """Shift it."""
        taken.append((chosen.clock_offset, typed_names(chosen)))

    @make_call(Renamed)
    def call(chosen: Renamed) -> None:
        """Shifts it."""
        taken.append((chosen.clock_offset, typed_names(chosen)))

    said = []
    for run in (
        lambda: shift.main(["--offset", "2"], standalone_mode=False),
        lambda: shift.main(["--offset=2"], standalone_mode=False),
        lambda: call(offset=2),  # type: ignore[call-arg]
        lambda: shift.main(["--clock-offset", "2"], standalone_mode=False),
    ):
        run()
        said.append(capsys.readouterr().err.strip())
    assert taken == [(2.0, {"clock_offset"})] * 4
    warned = "warning: --offset is called --clock-offset now"
    assert said == [warned, warned, "warning: offset is called clock_offset now", ""]
    with pytest.raises(UsageError, match="both are given"):
        shift.main(["--offset", "2", "--clock-offset", "3"], standalone_mode=False)
    assert "--offset" not in shift.get_help(click.Context(shift)).replace("--clock-offset", "")


def test_the_value_of_a_former_option_is_read_where_an_argument_stands_now(
    capsys: pytest.CaptureFixture[str],
) -> None:
    @options
    class Sources:
        sources: tuple[str, ...] = argument("Sources.", "SOURCE...", default=(), was=("--recipe",))

    @command(Sources)
    def judge(chosen: Sources) -> None:
        """Judge."""
        taken.append(chosen.sources)

    taken: list[tuple[str, ...]] = []
    for words in (
        ["--recipe", "x.toml", "a.csv"],
        ["--recipe=x.toml", "a.csv"],
        ["x.toml", "a.csv"],
    ):
        judge.main(words, standalone_mode=False)
    assert taken == [("x.toml", "a.csv")] * 3
    warned = "warning: give SOURCE without --recipe, which is no longer an option"
    assert capsys.readouterr().err.splitlines() == [warned] * 2


@pytest.fixture
def taken() -> list[Made]:
    return []


@pytest.fixture
def made(taken: list[Made]) -> tuple[LongCommand, Callable[..., None]]:
    @command(Made)
    def make_it(chosen: Made) -> None:
        """Make it."""
        taken.append(chosen)

    @make_call(Made)
    def call(chosen: Made) -> None:
        """Makes it.

        Raises:
            UsageError: too short a window.
        """
        taken.append(chosen)

    return make_it, call


def test_what_was_typed_is_known_also_where_it_is_the_default(made: Any, taken: list[Made]) -> None:
    make_it, call = made
    make_it.main(["x", "--window", "2500ms", "--name", "a", "--name", "b"], standalone_mode=False)
    call("x", window=2.5, names=("a", "b"))
    call("x", window=3)
    assert make_it.name == "make-it"
    assert taken[0] == taken[1] == Made(source="x", window=2.5, names=("a", "b"), loud=False)
    assert str(taken[2].window) == "3.0"  # the same in a recipe as on the command line
    assert [typed_names(one) for one in taken[:2]] == [{"source", "window", "names"}] * 2
    assert typed_names(Made(source="x")) == set()


def test_a_value_that_does_not_fit_is_refused_by_the_name_that_the_user_knows(made: Any) -> None:
    make_it, call = made
    with pytest.raises(UsageError) as of_command:
        make_it.main(["x", "--window", "0.5s"], standalone_mode=False)
    with pytest.raises(UsageError) as of_call:
        call("x", window=0.5)
    assert (of_command.value.where, of_call.value.where) == ("--window", "window")
    with pytest.raises(UsageError, match="window is 'long', which is no number"):
        call("x", window="long")
    with pytest.raises(TypeError, match="unexpected keyword argument 'windows'"):
        call("x", windows=3)


def test_a_call_describes_its_options_before_its_errors(made: Any) -> None:
    _, call = made
    head, _, rest = (call.__doc__ or "").partition("Args:")
    assert head.strip() == "Makes it."
    assert rest.index("window: Length of a window [s].") < rest.index("Raises:")
    assert str(inspect.signature(call)).startswith("(source: str, *, window: float = 2.5")


def test_a_package_is_called_as_the_verb_of_its_name() -> None:
    for name, call in (
        ("align", recording_verbs.align),
        ("export", lake_verbs.export),
        ("ingest", recording_verbs.ingest),
    ):
        package: Any = import_module(f"flagdata.{name}")
        assert package is getattr(flagdata, name)
        assert inspect.signature(package) == inspect.signature(call)
        said = inspect.getdoc(package) or ""
        assert said.startswith(f"flagdata.{name}(")  # a package has no signature in its help
        assert said.endswith(inspect.getdoc(call) or "nothing")
