"""What `flagdata ingest` prints: the report of an ingest, and what a source seems to be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from flagdata.core.console import echo, echo_lines
from flagdata.core.shell import command_line

if TYPE_CHECKING:
    from flagdata.ingest.artifacts_present import IngestResult


_ONCE = frozenset({"why", "note"})
"""What is printed of one artifact alone where another of the same source has it, too."""


def print_results(results: Sequence[IngestResult]) -> None:
    """What one source became, for people, on stdout."""
    printed: set[tuple[str, str]] = set()
    for result in results:
        _print_result(result, printed)


def _print_result(result: IngestResult, printed: set[tuple[str, str]]) -> None:
    """One artifact; reasons and notes that were printed of another of the same source are left
    out."""
    artifact, report = result.artifact, result.report
    if result.healed is not None:
        echo(f"{artifact.id}  {artifact.kind} {artifact.name}: {result.healed.sentence}")
        return
    if not result.created:
        echo(
            f"already in the lake: {artifact.id}  {artifact.kind} {artifact.name} (from "
            f"{artifact.source_name})"
        )
        return
    echo(f"{artifact.id}  {artifact.kind} {artifact.name} (from {artifact.source_name})")
    again = 0
    for label, text in _lines(report):
        if label in _ONCE and (label, text) in printed:
            again += 1
            continue
        printed.add((label, text))
        echo(f"  {label:<8} {text}")
    if again:
        echo(f"  {'':<8} and {again} reasons and notes as above")


def _lines(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    lines = [("format", report["format"])]
    lines += [("why", reason) for reason in report["reasons"]]
    if report["kind"] == "meshes":
        lines += _mesh_lines(report)
    elif report["kind"] == "markers":
        lines += _marker_lines(report)
    elif report["kind"] == "record":
        lines += _record_lines(report)
    else:
        lines += _device_lines(report)
    for finding in report["findings"]:
        where = f" ({finding['where']})" if finding["where"] else ""
        lines.append((finding["severity"], f"{finding['kind']}: {finding['what']}{where}"))
        if finding["fix"]:
            lines.append(("", f"fix: {finding['fix']}"))
    return lines


def _mesh_lines(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    rate = "–" if report["rate"] is None else f"{report['rate']:.6g} Hz"
    vertices, faces = (
        "–".join(map(str, sorted(set(report[what])))) for what in ("vertices", "faces")
    )
    return [
        (
            "time",
            f"{report['first']:.3f} to {report['first'] + report['span']:.3f} s of the simulation",
        ),
        ("frames", f"{report['frames']} at {rate}"),
        ("mesh", f"{vertices} vertices, {faces} faces, {report['topology']} topology"),
    ]


def _marker_lines(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    rate = "–" if report["rate"] is None else f"{report['rate']:.6g} Hz"
    return [
        ("frames", f"{report['frames']} at {rate}, over {report['span']:.3f} s"),
        ("markers", f"{report['markers']}, {report['tracked']} positions tracked"),
    ]


def _record_lines(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    wind = ", with wind" if report["wind"] else ""
    return [
        ("time", f"{report['start']} to {report['end']} ({report['span']:.3f} s)"),
        ("frames", f"{report['frames']}{wind}"),
    ]


def _device_lines(report: Mapping[str, Any]) -> list[tuple[str, str]]:
    lines: list[tuple[str, str]] = []
    lines.append(("time", f"{report['start']} to {report['end']} ({report['span']:.3f} s)"))
    rate = "–" if report["rate"] is None else f"{report['rate']:.6g} Hz"
    if report["kind"] == "camera":
        camera = report["camera"]
        x, y, width, height = camera["crop"]
        lines.append(("start", f"{camera['start']}, from {camera['start_from']}"))
        lines.append(
            (
                "frames",
                (
                    f"{report['frames']} at {rate}, worst stamp error "
                    f"{report['worst_stamp_error'] * 1e3:.3f} ms"
                ),
            )
        )
        source = (
            f"{camera['width']}×{camera['height']}, container {camera['container_rate']:.6g} Hz, "
            f"true {camera['true_rate']:.6g} Hz, "
            f"{'variable' if camera['variable_rate'] else 'constant'} rate; "
            f"crop {width}×{height} at {x},{y}"
        )
        lines.append(("source", source))
    else:
        channels = ", ".join(f"{name} [{c['unit']}]" for name, c in report["channels"].items())
        lines.append(("samples", f"{report['samples']}, median rate {rate}: {channels}"))
        lines.append(("sensor", report["sensor"]["name"]))
    return lines


def _how_sure(guess: Mapping[str, Any]) -> str:
    """What speaks for a guess: the format's own score, or whether a draft has questions."""
    if guess["draft"] and guess["kind"] == "anemometer":
        return "by its columns, with questions" if guess["doubts"] else "by its columns"
    return f"{guess['score']:.0%} match"


def print_sniffed(entry: Mapping[str, Any]) -> None:
    """One source and its guesses for people, on stdout."""
    echo(entry["source"])
    for guess in entry["guesses"]:
        recipe = f", recipe {guess['recipe']}" if guess["recipe"] else ""
        echo(f"  {guess['kind']}: {guess['format']}{recipe} ({_how_sure(guess)})")
        for reason in guess["reasons"]:
            echo(f"    because {reason}")
        if guess["fix"] and guess["kind"] != "camera" and not guess["doubts"]:
            echo(f"    to do: {guess['fix']}")
        for note in guess["notes"]:
            echo(f"    not taken or odd: {note}")
        if len(guess["winds"]) > 1:
            how = (
                ""
                if guess is entry["guesses"][0]
                else f" with {command_line('--as', guess['format'])}"
            )
            winds = ", ".join(guess["winds"])
            echo(f"    {len(guess['winds'])} anemometers, each becomes an artifact{how}: {winds}")
        for doubt in guess["doubts"]:
            echo(f"    to answer: {doubt}")
        if guess["draft"]:
            asked = "what is asked above is missing" if guess["doubts"] else "nothing is missing"
            state = "complete it where it says ?" if '"?"' in guess["draft"] else asked
            echo(f"    the recipe ({state}; name it by --recipe FILE.toml to change anything):")
            echo_lines("\n".join(f"      {line}" for line in guess["draft"].splitlines()))
    if "problem" in entry:
        echo(f"  {entry['problem']['what']}: {entry['problem']['fix']}")
    if "camera" in entry:
        seen = entry["camera"]
        echo(
            f"  {seen['container']} / {seen['codec']}, {seen['width']}×{seen['height']}, "
            f"{seen['frames']} frames "
            f"at {seen['rate']:.6g} Hz{' (variable)' if seen['variable_rate'] else ''}, "
            f"{seen['duration']:.3f} s"
        )
        echo(f"  start: {seen['start'] or 'unknown, give --start'}")
    if "crop" in entry:
        box = ",".join(map(str, entry["crop"]["box"]))
        echo(f"  crop: {box} holds {entry['crop']['share']:.0%} of the motion")
