"""Whatever ends a command, the error has one form."""

from __future__ import annotations

import json
from collections.abc import Callable

import click
import pytest

from flagdata import cli
from flagdata.errors import InputError, LimitError


@pytest.fixture
def run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Runs a command that raises the error given: exit code, stdout, stderr."""

    def run(
        error: BaseException, *options: str, before: tuple[str, ...] = ()
    ) -> tuple[int, str, str]:
        @click.command()
        @click.option("--json", "as_json", is_flag=True)
        def broken(as_json: bool) -> None:
            assert as_json is ("--json" in options)
            raise error

        monkeypatch.setattr(cli.LazyGroup, "get_command", lambda *_: broken)
        monkeypatch.setitem(cli.VERBS, "broken", ("", ""))
        with pytest.raises(SystemExit) as ended:
            cli.main([*before, "broken", *options])
        printed = capsys.readouterr()
        return int(ended.value.code or 0), printed.out, printed.err

    return run


@pytest.mark.parametrize(
    "error",
    [KeyError("x"), RecursionError(), ZeroDivisionError("no"), ExceptionGroup("g", [OSError()])],
)
def test_an_unforeseen_exception_is_one_line_with_the_request_to_report_it(
    run, error: Exception
) -> None:
    code, out, err = run(error)
    assert (code, out) == (1, "")
    assert err.startswith(f"flagdata: an unforeseen error occurred: {type(error).__name__}")
    assert "please report it" in err
    assert "Traceback" not in err


def test_what_the_system_refuses_is_no_defect_also_where_a_library_gives_no_number(run) -> None:
    """As PyArrow raises it for a file that cannot be looked at."""
    code, _, err = run(OSError("error stat()ing file"))
    assert code == 1
    assert err.startswith("flagdata: the system refused: error stat()ing file")


def test_the_traceback_is_shown_when_asked_for(run, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "Traceback" in run(KeyError("x"), before=("--debug",))[2]
    assert "Traceback" in run(InputError("bad", fix="good"), before=("--debug",))[2]
    monkeypatch.setenv("FLAGDATA_DEBUG", "1")
    assert "Traceback" in run(KeyError("x"))[2]


def test_programs_read_the_kind_of_what_was_unforeseen(run) -> None:
    document = json.loads(run(KeyError("x"), "--json")[1])
    assert (document["schema"], document["kind"]) == ("flagdata.error/1", "unforeseen")


def test_what_the_system_refuses_is_named_with_its_file(run) -> None:
    code, _, err = run(PermissionError(13, "Permission denied", "/data/x"))
    assert code == 1
    assert err.splitlines()[:2] == [
        "flagdata: the system refused: Permission denied",
        "  where: /data/x",
    ]


def test_a_file_that_ends_too_early_is_no_interruption_by_the_user(run) -> None:
    code, _, err = run(EOFError("No data left in file"))
    assert code == 1
    assert "an unforeseen error occurred: EOFError: No data left in file" in err
    assert "interrupted" not in err
    code, _, err = run(KeyboardInterrupt())
    assert (code, err.strip()) == (1, "flagdata: interrupted")


def test_memory_that_runs_out_is_a_limit(run) -> None:
    assert json.loads(run(MemoryError(), "--json")[1])["kind"] == LimitError.kind


def test_a_name_that_is_no_utf8_is_printed_escaped(run) -> None:
    document = json.loads(run(InputError("bad", where="a\udcff", fix="rename"), "--json")[1])
    assert document["where"] == "a\udcff"
