"""`flagdata case`: measure a real case, model it, and report what the model lacked."""

from __future__ import annotations

from pathlib import Path

import click

from flagdata.console import LocalPath, document, json_option, progress, say, table


@click.command()
@click.argument("name")
@click.argument("data", type=LocalPath(exists=True, file_okay=False))
@click.option("--out", type=LocalPath(), required=True, help="Folder for the report.")
@json_option
def case(name: str, data: Path, out: Path, as_json: bool) -> None:
    """Study the case NAME (paper-flag) with the recordings in the folder DATA.

    Writes index.html, its pictures and result.json into the folder. What was tracked and simulated is kept there in
    `kept`, so that an interrupted study goes on from there.
    """
    from measure.cases import page
    from measure.cases.observe import observe
    from measure.cases.recipe import load_case
    from measure.cases.study import strips, study
    from measure.cases.verdict import judge

    chosen = load_case(name)
    page.check(out)
    keep = out / "kept"
    with progress(len(chosen.clips), label="tracking", unit="clip") as advance:
        seen = observe(chosen, data, keep=keep, advance=advance)
    with progress(strips(chosen), label="simulating", unit="strip") as advance:
        found = study(chosen, seen, keep=keep, advance=advance)
    verdict = judge(chosen, seen, found)
    target = page.write(out, case=chosen, seen=seen, study=found, verdict=verdict)
    if as_json:
        document("case", {**page.as_json(chosen, seen, found, verdict), "page": str(target)})
    else:
        table(("", ""), page.summary(found, verdict).items())
    say(f"Open {target}")
