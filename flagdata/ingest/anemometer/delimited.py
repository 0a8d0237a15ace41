"""The format "delimited": text in columns, described by a sensor recipe."""

from __future__ import annotations

from flagdata.errors import UsageError
from flagdata.ingest.anemometer import platform
from flagdata.ingest.anemometer import recipe as recipes
from flagdata.ingest.anemometer.draft import draft
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.rows import RowReader
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.sonic import with_horizontal
from flagdata.ingest.anemometer.source import TextFile
from flagdata.ingest.anemometer.table import read_table


class Delimited:
    """Format "delimited": a recipe of catalogs/sensors, or the user's own TOML file."""

    name = "delimited"
    about = "delimited text described by a sensor recipe"
    uses = frozenset({"zone", "azimuth", "platform"})

    def recognise(self, head: Head) -> Guess | None:
        """The recipe whose columns the header names; the one with most columns in common. Else the draft of one."""
        best: Guess | None = None
        for name in recipes.SENSORS.names():
            guess = _match(recipes.load(name), name, head)
            if guess and (best is None or guess.score > best.score):
                best = guess
        if best is not None:
            return best
        proposal = draft(head.lines)
        if proposal is None:
            return None
        return Guess(
            format="delimited",
            score=0.3,
            reasons=("no recipe of the catalog names these columns", *proposal.reasons),
            fix="save the draft that `flagdata ingest --sniff` prints, complete it, and name it: "
            "--recipe FILE.toml of ingest, --sensor FILE.toml of close-loop",
            draft=proposal.toml,
        )

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read a file by the recipe in `options`."""
        if options.recipe is None:
            raise UsageError("the format delimited needs a recipe", where=str(source.path), fix="name one by --recipe")
        recipe = recipes.load(options.recipe)
        if recipe.file.host:
            raise UsageError(
                f"the recipe {recipe.name} is for host-stamped lines",
                where=str(source.path),
                fix="use --as host-stamped",
            )
        rows = RowReader(source, recipe.file)
        where = str(source.path)
        columns = platform.position_columns(rows.header or ())
        table = read_table(rows, recipe, where=where, zone_name=options.zone, extra=columns or ())
        reading = with_horizontal(table.reading, options.azimuth, where=where)
        positions = {name: table.extra[column] for name, column in zip(platform.POSITION, columns or (), strict=False)}
        return platform.settle(reading, options.platform, positions=positions, where=where)


def _match(recipe: Recipe, name: str, head: Head) -> Guess | None:
    layout = recipe.file
    if layout.host or layout.header == 0 or len(head.lines) <= layout.preamble:
        return None
    line = head.lines[layout.preamble]
    cells = [
        cell.strip().strip('"') for cell in (line.split() if layout.delimiter == " " else line.split(layout.delimiter))
    ]
    needed = [c.column for c in recipe.channels.values() if not c.optional] + list(recipe.time.columns)
    if not all(column in cells for column in needed):
        return None
    found = [c.column for c in recipe.channels.values() if c.column in cells]
    return Guess(
        format="delimited",
        recipe=name,
        score=min(0.95, 0.6 + 0.05 * (len(found) + len(recipe.time.columns))),
        reasons=(f"line {layout.preamble + 1} names the columns of recipe {name}: {', '.join(map(str, needed))}",),
    )
