"""`flagdata label`: columns of the user's own on artifacts."""

from __future__ import annotations

import click

from flagdata.console import document, echo, json_option, lake_option
from flagdata.errors import UsageError
from flagdata.printable import counted


@click.command()
@click.argument("words", nargs=-1, required=True, metavar="ARTIFACT... NAME=VALUE...")
@click.option("--message", "-m", help="Why.")
@click.option("--branch", "branch_name", default="main", show_default=True, help="The branch to put them on.")
@json_option
@lake_option
def label(words: tuple[str, ...], message: str | None, branch_name: str, as_json: bool, lake_path: str) -> None:
    """Put columns of your own on artifacts: NAME=VALUE is a number, true or false, or a text; NAME= takes one off.

    Queries, exports and pairs have each as the column label_NAME. A recording's labels are its clips', too.

    \b
      flagdata label flag-monday colour=red rating=4 usable=true
      flagdata query --where "label_rating >= 4" --columns name,label_colour
    """
    from flagdata.lake import Lake
    from flagdata.lake.labels import given

    lake = Lake.open(lake_path)
    values = dict(given(word) for word in words if "=" in word)
    named = [lake.identity(word, at=branch_name) for word in words if "=" not in word]
    if not values or not named:
        raise UsageError("the artifact or the label is missing", fix="flagdata label ARTIFACT NAME=VALUE")
    what = message or f"label {', '.join(values)}"
    version, labelled = lake.label(named, values, what, branch=branch_name)
    if as_json:
        document("label", {"version": version, "artifacts": sorted(labelled), "labels": values})
    else:
        echo(f"version {version}: {counted(len(labelled), 'artifact')} labelled")
