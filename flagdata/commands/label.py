"""`flagdata label`: columns of the user's own on artifacts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flagdata.core.console import echo
from flagdata.core.printable import count_of
from flagdata.errors import UsageError
from flagdata.verbs.shared_options import OnBranch, OnLake, Reasoned
from flagdata.verbs.verb_options import Result, argument, options, verb


@options
class Labelling(Reasoned, OnBranch, OnLake):
    """Which artifacts get which labels."""

    words: Sequence[str] = argument(
        "Names or ids of artifacts, and labels as NAME=VALUE.",
        "ARTIFACT... NAME=VALUE...",
        nargs=-1,
    )


@verb(Labelling, example='flagdata.label(["flag", "usable=true"], lake="field.lake")')
def label(chosen: Labelling) -> Iterator[Result]:
    """Put columns of your own on artifacts: NAME=VALUE is a number, true or false, or a text; NAME=
    takes one off.

    Queries, exports and pairs have each as the column label_NAME. A recording's labels are its
    clips', too.

    \b
      flagdata label flag-monday colour=red rating=4 usable=true
      flagdata query --where "label_rating >= 4" --columns name,label_colour
    """
    from flagdata.lake.labels import given

    lake = chosen.opened()
    values = dict(given(word) for word in chosen.words if "=" in word)
    named = [lake.identity(word, at=chosen.branch) for word in chosen.words if "=" not in word]
    if not values or not named:
        raise UsageError(
            "the artifact or the label is missing", fix="flagdata label ARTIFACT NAME=VALUE"
        )
    reason = chosen.message or f"label {', '.join(values)}"
    version, labelled = lake.label(named, values, reason, branch=chosen.branch)
    yield Result("label", {"version": version, "artifacts": sorted(labelled), "labels": values})
    echo(f"version {version}: {count_of(len(labelled), 'artifact')} labelled")
