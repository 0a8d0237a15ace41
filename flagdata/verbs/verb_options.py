"""Options of a verb, stated once: its command, its Python call and their documentation are made
from one dataclass.

    @options
    class Observing(OfFilm):
        source: str = argument("The film.", "SOURCE")
        window: float = option("Length of a window.", default=2.5, type=DURATION)

    @command(Observing)                    @called(Observing)
    def observe(chosen: Observing): ...    def observe(chosen: Observing): ...

A verb's arguments are what its Python call takes by position. What several verbs share is a class
that theirs inherit; what only the command has, as the form of what it prints, is a class that
inherits that of the call.

Where command and call differ in nothing but that, one function makes both. It yields its result,
which the call returns and `--json` prints; what it does afterwards prints the result for people.

    @verb(Listing, example='flagdata.ls(lake="field.lake")["artifacts"]')
    def ls(chosen: Listing) -> Iterator[Result]:
        rows = chosen.opened().rows()
        yield Result("ls", {"artifacts": rows})
        table(HEADER, rows)
"""

from __future__ import annotations

import functools
import inspect
import sys
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, dataclass_transform

import click
from click.core import ParameterSource

from flagdata.core.console import document, say
from flagdata.errors import FlagdataError
from flagdata.recipes.retired_names import warn_of_old_name

if TYPE_CHECKING:
    from flagdata.answer.answer import Answer

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C", bound=type)

REST = "Lake and output"
"""Section of the options that name none."""
SECTIONS = (
    "What the source is",
    "Camera",
    "Anemometer",
    "The clock",
    "The recording",
    "What is judged",
    "The flag",
    "The flag and the camera",
    "The film",
    "Markers and meshes",
    "The wind beside markers",
    "A log beside tables",
    "The test",
    "How it is done",
    "What is written",
    REST,
)
"""Titles of the sections of long helps, in their order."""
_KINDS = {"int": click.INT, "float": click.FLOAT, "Path": click.Path()}
_WIDTH = 116


@dataclass(frozen=True, kw_only=True)
class Option:
    """What an option says of itself beside its name, kind and default.

    Attributes:
        about: one sentence, with the unit.
        names: on the command line; none for the field's name.
        section: of a long help.
        argument: whether the command takes it by position.
        was: its names of the last version, which are read with a warning.
        now: what says it now, of an option of the last version that no help shows; it is read with
            a warning.
        click: more that `click.Option` or `click.Argument` is given.
    """

    about: str
    names: tuple[str, ...] = ()
    section: str = REST
    argument: bool = False
    was: tuple[str, ...] = ()
    now: str = ""
    click: Mapping[str, Any] = field(default_factory=dict)

    def spelling_of(self, key: str) -> str:
        """Returns the name on the command line that errors use, of the option of such a field."""
        return next(
            (name for name in self.names if name.startswith("--")), f"--{key.replace('_', '-')}"
        )


def option(
    about: str,
    *names: str,
    default: Any = MISSING,
    section: str = REST,
    kw_only: bool = True,
    was: tuple[str, ...] = (),
    now: str = "",
    **more: Any,
) -> Any:
    """States an option as the default of a field.

    Args:
        about: its help.
        names: on the command line; none for the field's name.
        default: where it is not given; without one it is required.
        section: of a long help.
        kw_only: whether the Python call takes it by keyword alone.
        was: its names of the last version.
        now: what says the same now, of an option of the last version.
        more: of `click.Option`, as `type`, `metavar` and `envvar`.
    """
    if now:
        more["hidden"] = True
    row = Option(about=about, names=names, section=section, was=was, now=now, click=more)
    return field(default=default, kw_only=kw_only, metadata={"option": row})


def argument(
    about: str,
    metavar: str,
    *,
    default: Any = MISSING,
    kw_only: bool = False,
    was: tuple[str, ...] = (),
    **more: Any,
) -> Any:
    """States what a command and a call take by position, as the default of a field.

    Args:
        about: what it names, for the Python call.
        metavar: on the command line.
        default: where it is not given; without one it is required.
        kw_only: whether the Python call takes it by keyword alone.
        was: options of the last version whose value is taken by position now.
        more: of `click.Argument`, as `nargs` and `type`.
    """
    row = Option(about=about, argument=True, was=was, click={"metavar": metavar, **more})
    return field(default=default, kw_only=kw_only, metadata={"option": row})


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(option, argument))
def options(form: C) -> C:
    """Makes a frozen dataclass of a class whose fields are options."""
    return dataclass(frozen=True, kw_only=True)(form)


def described_fields(form: type) -> dict[str, tuple[Field[Any], Option]]:
    """Returns field → itself and its option: those of a class before those that it inherits.

    What a class states in `HELP`, field → text, stands in place of the help that it inherits.
    """
    table = {one.name: one for one in fields(form)}
    names = dict.fromkeys(
        name for base in form.__mro__ for name in vars(base).get("__annotations__", ())
    )
    texts: dict[str, str] = getattr(form, "HELP", {})
    return {
        name: (table[name], _help_of_option(table[name], texts.get(name)))
        for name in names
        if name in table
    }


def _help_of_option(of_option: Field[Any], text: str | None) -> Option:
    row: Option = of_option.metadata["option"]
    return row if text is None else replace(row, about=text)


def typed_names(chosen: object) -> frozenset[str]:
    """Returns the names of the options that the user gave, at their defaults or not."""
    return vars(chosen).get("_typed", frozenset())


def _with_typed(chosen: Any, names: frozenset[str]) -> Any:
    for key, (_, row) in described_fields(type(chosen)).items():
        if row.now and key in names:
            say(f"{row.spelling_of(key)} is of the last version: give {row.now}", mark="warning")
    vars(chosen)["_typed"] = names
    return chosen


class SectionedOption(click.Option):
    """An option that says in which section of a long help it is.

    Attributes:
        section: its title.
        was: its names of the last version.
    """

    def __init__(
        self, *names: Any, section: str = REST, was: tuple[str, ...] = (), **more: Any
    ) -> None:
        super().__init__(*names, **more)
        self.section = section
        self.was = was


class PlacedArgument(click.Argument):
    """An argument whose value an option took.

    Attributes:
        was: names of the option.
    """

    def __init__(self, *names: Any, was: tuple[str, ...] = (), **more: Any) -> None:
        super().__init__(*names, **more)
        self.was = was


class LongCommand(click.Command):
    """A command whose help prints its options in their sections, and that reads their names of the
    last version."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        options = [param for param in self.params if isinstance(param, SectionedOption)]
        renamed = {old: option.opts[0] for option in options for old in option.was}
        arguments = [param for param in self.params if isinstance(param, PlacedArgument)]
        by_position = {
            old: argument.make_metavar(ctx).removesuffix("...")
            for argument in arguments
            for old in argument.was
        }
        words = [word for name in args for word in _by_position(name, by_position)]
        return super().parse_args(ctx, [_present(word, renamed, args) for word in words])

    def sections(self) -> dict[str, list[click.Option]]:
        """Returns title → options, in the order of `SECTIONS`; those without a section last."""
        shown: dict[str, list[click.Option]] = {title: [] for title in SECTIONS}
        for one in self.params:
            if isinstance(one, click.Option):
                shown[getattr(one, "section", REST)].append(one)
        return {title: rows for title, rows in shown.items() if rows or title == REST}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        shown = self.sections()
        shown[REST] += [one for one in (self.get_help_option(ctx),) if one is not None]
        for title, rows in shown.items():
            records = [row for one in rows if (row := one.get_help_record(ctx)) is not None]
            with formatter.section(title if len(shown) > 1 else "Options"):
                formatter.write_dl(records)


@options
class AsJson:
    """What every command can print."""

    as_json: bool = option("One JSON document on stdout.", "--json", default=False)


def command(
    form: type[Any], *, cls: type[LongCommand] = LongCommand
) -> Callable[[Callable[[Any], object]], LongCommand]:
    """Makes the command of a verb from the class of its options and the function that runs it.

    The function's docstring is the help, and its name that of the command.

    Args:
        cls: of the command.
    """

    def made(run: Callable[[Any], object]) -> LongCommand:
        def callback(**values: Any) -> object:
            context = click.get_current_context()
            names = {
                one
                for one in values
                if context.get_parameter_source(one) is ParameterSource.COMMANDLINE
            }
            return run(_with_typed(form(**values), frozenset(names)))

        return cls(
            name=run.__name__.strip("_").replace("_", "-"),
            params=[_parameter(key, *row) for key, row in described_fields(form).items()],
            callback=callback,
            help=inspect.getdoc(run),
        )

    return made


def _present(word: str, renamed: Mapping[str, str], words: Collection[str]) -> str:
    """Returns a word of a command line with the name that an option has now, and warns of the old
    one.

    Raises:
        UsageError: there are both names among the words.
    """
    name, equals, value = word.partition("=")
    if name not in renamed:
        return word
    present = renamed[name]
    warn_of_old_name(name, present, {other.partition("=")[0] for other in words}, where=name)
    return f"{present}{equals}{value}"


def _by_position(word: str, names: Mapping[str, str]) -> tuple[str, ...]:
    """Returns a word of a command line without the name of an option whose value is an argument
    now, and warns."""
    name, _, value = word.partition("=")
    if name not in names:
        return (word,)
    say(f"give {names[name]} without {name}, which is no longer an option", mark="warning")
    return (value,) if value else ()


def _parameter(key: str, place: Field[Any], row: Option) -> click.Parameter:
    """Returns the parameter of a field; its kind is read from the annotation where the option
    states no other."""
    kind = str(place.type).removesuffix(" | None")
    more: dict[str, Any] = {
        "type": _KINDS.get(kind.removeprefix("tuple[").removesuffix(", ...]")),
        **row.click,
    }
    several = kind.endswith(", ...]")
    required = place.default is MISSING
    if row.argument:
        several = {"nargs": -1} if several else {}
        return PlacedArgument(
            [key], required=required, was=row.was, **{"default": None, **several, **more}
        )
    if kind == "bool":
        more.update(is_flag=True, type=None)
    elif several:
        more["multiple"] = True
    elif not required and place.default is not None:
        more = {"show_default": True, **more}
    names = row.names or (row.spelling_of(key),)
    default = {} if required else {"default": more.pop("default", place.default)}
    about = (
        f"{row.about.removesuffix('.')}; also {more['envvar']}." if "envvar" in more else row.about
    )
    return SectionedOption(
        [*names, key],
        section=row.section,
        was=row.was,
        help=about,
        required=required,
        **default,
        **more,
    )


def make_call(form: Callable[P, object]) -> Callable[[Callable[[Any], R]], Callable[P, R]]:
    """Makes the Python call of a verb from the class of its options and the function that runs it.

    Values become plain Python's, each by its annotation (`flagdata.core.arguments`). The options
    are described in the call's docstring, before what it raises. Errors about an option name it as
    the call does.
    """
    from flagdata.core.arguments import converter, unquoted  # loads NumPy

    build: Any = form
    rows = described_fields(build)
    converts = {
        key: plain
        for key, (place, _) in rows.items()
        if (plain := converter(str(place.type))) is not None
    }
    floats = {
        key
        for key, (place, _) in rows.items()
        if str(place.type).removesuffix(" | None") == "float"
    }
    signature = inspect.signature(form)
    renamed = {_keyword(old): key for key, (_, row) in rows.items() for old in row.was}
    spelled = {
        name: key for key, (_, row) in rows.items() for name in (*row.names, row.spelling_of(key))
    }
    ordered = sorted((signature.parameters[key] for key in rows), key=lambda one: one.kind)

    def made(run: Callable[[Any], R]) -> Callable[P, R]:
        @functools.wraps(run)
        def call(*positional: P.args, **named: P.kwargs) -> R:
            present = {_present(key, renamed, named): value for key, value in named.items()}
            values = bind(*positional, **present).arguments
            plain = {
                key: converts[key](value, key) if key in converts else value
                for key, value in values.items()
            }
            plain |= {
                key: float(plain[key]) for key in floats & plain.keys() if plain[key] is not None
            }
            try:
                return run(_with_typed(build(**plain), frozenset(plain)))
            except FlagdataError as error:
                if error.where in spelled:
                    FlagdataError.__init__(
                        error, error.what, where=spelled[error.where], fix=error.fix
                    )
                raise

        shown = unquoted(
            signature.replace(parameters=ordered, return_annotation=run.__annotations__["return"])
        )
        bind: Any = shown.bind
        head, raised, rest = (inspect.getdoc(run) or "").partition("\nRaises:")
        vars(call).update(converts=frozenset(converts), __signature__=shown)
        call.__doc__ = f"{head}\nArgs:\n{_arguments(rows)}\n{raised}{rest}"
        return call

    return made


@dataclass(frozen=True)
class Result:
    """What a verb gives back.

    Attributes:
        tag: of its JSON document, see `flagdata.core.console.document`.
        content: of it.
        exit_code: of the command.
        answer: what the call returns in place of the content, of a question.
    """

    tag: str
    content: Mapping[str, Any]
    exit_code: int = 0
    answer: Answer | None = None


_NOTHING = Result("", {})


def verb(
    form: Callable[P, object], *, example: str
) -> Callable[[Callable[[Any], Iterator[Result]]], Callable[P, Mapping[str, Any]]]:
    """Makes the Python call of a verb from the class of its options and the function that runs it.

    Its attribute `command` is the command of the same name, which has `--json` beside the options
    of the class, and `result` takes an object of the class. The function's docstring is the help. A
    function that yields nothing leaves the result to another process.

    Args:
        example: of the call, in place of the command lines of the help.
    """

    def made(run: Callable[[Any], Iterator[Result]]) -> Callable[P, Mapping[str, Any]]:
        @functools.wraps(run)
        def print_result(chosen: Any) -> None:
            steps = run(chosen)
            result = next(steps, None)
            if result is None:
                return
            if chosen.as_json:
                document(result.tag, result.content)
            else:
                for _ in steps:
                    pass
            if result.exit_code:
                sys.exit(result.exit_code)

        @functools.wraps(run)
        def result(chosen: Any) -> Any:
            with closing(run(chosen)) as steps:  # type: ignore[type-var]  a generator
                made = next(steps, _NOTHING)
            return made.content if made.answer is None else made.answer

        bases: Any = (form, AsJson)
        shown = command(options(type(run.__name__, bases, {"__module__": run.__module__})))(
            print_result
        )
        name = str(shown.name)
        about = (
            part for part in (inspect.getdoc(run) or "").split("\n\n") if not part.startswith("\b")
        )
        shows = (
            f"```python\n{example}\n```",
            f"Returns:\n    What `flagdata {name} --json` prints.",
        )
        result.__doc__ = "\n\n".join((*about, *shows))
        result.__annotations__ = {"return": "Mapping[str, Any]"}
        call = make_call(form)(result)
        vars(call).update(command=shown, result=result)
        return call

    return made


def _keyword(name: str) -> str:
    """Returns the argument of a Python call that has the name of an option."""
    return name.removeprefix("--").replace("-", "_")


def _told(row: Option) -> str:
    """Returns what the documentation of a call says of an option."""
    return f"{row.about} Of the last version: give {row.now}." if row.now else row.about


def _arguments(rows: Mapping[str, tuple[Field[Any], Option]]) -> str:
    """Returns what a docstring says of each option."""
    return "\n".join(
        textwrap.fill(
            f"{key}: {_told(row)}", _WIDTH, initial_indent="    ", subsequent_indent="        "
        )
        for key, (_, row) in rows.items()
    )
