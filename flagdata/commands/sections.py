"""Long helps in sections: which options of a command belong together, and the command that prints them so."""

from __future__ import annotations

import click

SECTIONS: dict[str, dict[str, str]] = {
    "ingest": {
        "What the source is": "sniff format_name name session topic episode rate unit start zone",
        "Camera": "join stream true_fps sequence_fps crop crop_picture exposure archive",
        "Anemometer": "sensor columns wind missing date date_order platform talker azimuth clock zero_offset encoding "
        "expect accept",
    },
    "align": {
        "The clock": "by offset offset_sigma centre search response response_sigma max_sigma",
        "The recording": "window name session",
    },
    "realign": {
        "The clock": "by offset offset_sigma centre search response response_sigma max_sigma",
        "The recording": "window name session",
    },
    "evaluate": {
        "What is judged": "dataset side at reference area_weight",
        "More in the table": "handmade frames linear tsne",
    },
    "measure": {
        "The flag": "flag_size area_weight material",
        "The film": "query crop flag first last true_fps sequence_fps",
        "How it is measured": "step model refine cache level seed false_alarm anyway",
        "What is written": "report zarr_path as_csv as_json",
    },
    "observe": {
        "The film": "flag_size seconds crop flag first last true_fps sequence_fps",
        "What is written": "parquet_path zarr_path picture_path as_json",
    },
    "calibrate": {
        "The flag and the camera": "flag_size attachment azimuth elevation distance material crop flag first last",
        "A log beside tables": "log offset",
        "How it is done": "only model name simulations workers cache level seed",
        "What is written": "report as_json",
    },
    "close-loop": {
        "Films": "flag_size attachment azimuth elevation distance area_weight crop flag first last log clock_offset "
        "simulations cache",
        "Markers and meshes": "recipe_path material density_uncertainty size pins rate unit up noise",
        "The wind beside markers": "winds axis north offset sensor zone accept",
        "The test": "level suspect nulls most_nulls bank seed workers",
    },
}
"""Command → title of a section → the parameters in it. Options that no section names come last."""
REST = "Lake and output"


class LongCommand(click.Command):
    """A command whose help prints its options in the sections of `SECTIONS`."""

    def sections(self) -> dict[str, list[click.Option]]:
        """Title → options, in the order of the table; what it does not name under `REST`."""
        options = {option.name: option for option in self.params if isinstance(option, click.Option)}
        table = {title: names.split() for title, names in SECTIONS[str(self.name)].items()}
        found = {title: [options.pop(name) for name in names] for title, names in table.items()}
        return {**found, REST: list(options.values())}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        shown = {title: list(options) for title, options in self.sections().items()}
        helped = self.get_help_option(ctx)
        shown[REST] += [helped] if helped is not None else []
        for title, options in shown.items():
            rows = [row for option in options if (row := option.get_help_record(ctx)) is not None]
            with formatter.section(title):
                formatter.write_dl(rows)
