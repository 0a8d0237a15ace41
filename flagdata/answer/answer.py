"""What a question to a recording is answered by: a sentence, quantities, findings, and sections
with tables and figures.

The same answer is shown in a terminal, as JSON, as a page, in a notebook and as an artifact, each
by one renderer. A question brings its sentences, tables and figures, and no renderer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flagdata.answer.charts import Chart
from flagdata.answer.quantity import Quantity
from flagdata.core.findings import Finding
from flagdata.core.parts import attribute
from flagdata.errors import UsageError

if TYPE_CHECKING:
    import xarray as xr
    from markupsafe import Markup

_INSTANTS = "nanoseconds since 1970-01-01"
"""Unit of instants in a Zarr folder, from which xarray makes them."""
Cell: TypeAlias = "str | Markup | Quantity | Sequence[str] | None"
"""A cell of a table: text, a part of a page, a quantity with its interval, lines of which the first
is the value and the others belong to it, or nothing."""


class Tone(StrEnum):
    """Whether the question is settled."""

    SETTLED = "settled"
    OPEN = "open"
    MISSED = "missed"
    """It was refused, or nothing of the library answers it."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows below named columns.

    Attributes:
        columns: with their units, "wind [m/s]"; none of a table of names and values.
        rows: each as long as `columns`.
        caption: below it.
    """

    columns: Sequence[str] = ()
    rows: Sequence[Sequence[Cell]]
    caption: str = ""

    @classmethod
    def of_values(cls, values: Mapping[str, Cell], *, caption: str = "") -> Table:
        """Makes a table of names and their values."""
        return cls(rows=[*values.items()], caption=caption)


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """A chart or picture with what it shows in words.

    Attributes:
        title: for who does not see it.
        content: a chart, the address of a picture (which may hold it), or a part of a page, or what
            makes one of these when it is shown.
        caption: below it.
        width: of a picture, or the most that a chart is wide [px]; as wide as the page if None.
    """

    title: str
    content: Chart | str | Markup | Callable[[], Chart | str | Markup]
    caption: str = ""
    width: int | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Gallery:
    """Small figures side by side."""

    figures: Sequence[Figure]


Part: TypeAlias = "str | Markup | Table | Figure | Gallery | Sequence[Finding]"
"""What a section is made of: paragraphs of text, parts of a page, tables, figures, findings."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A part of an answer.

    Attributes:
        title: its heading.
        parts: in order.
        anchor: by which a page is linked to it; none where it is empty.
        folded: whether a page shows its heading alone until it is opened.
    """

    title: str
    parts: Sequence[Part]
    anchor: str = ""
    folded: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Head:
    """What is on the first screen of a page, so that it can be sent to somebody.

    Attributes:
        figures: the film, and the wind of film and log; at most two.
        facts: what there is to know of it: date, place, clock, size, sensor, in this order.
        limits: what limits the answer: findings, or sentences.
        remarks: further paragraphs below the sentence.
    """

    figures: Sequence[Figure] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    limits: Sequence[str | Finding] = ()
    remarks: Sequence[str | Markup] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Array:
    """Numbers of an answer, one for each window, draw, marker or recording.

    Attributes:
        dimensions: name of each axis of `values`.
        values: SI.
        unit: of them; "1" of a ratio.
        about: what they are, in words.
        coordinate: whether they say where the others are, as times do.
    """

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    unit: str = "1"
    about: str = ""
    coordinate: bool = False


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Answer:
    """The answer to a question.

    Attributes:
        question: verb that asks it, "measure".
        subject: what was asked: the name of a film or of recordings.
        sentence: the answer in one sentence.
        tone: whether it is settled.
        quantities: name → quantity.
        arrays: name → array, what `to_xarray` returns.
        findings: what a reader has to know.
        document: everything as JSON values, as the verb writes it with --json.
        head: the first screen of its page.
        make_sections: makes what follows there, folded or not.
        provenance: name → what it was made from and by.
    """

    question: str
    subject: str
    sentence: str
    tone: Tone = Tone.SETTLED
    quantities: Mapping[str, Quantity] = field(default_factory=dict)
    arrays: Mapping[str, Array] = field(default_factory=dict)
    findings: Sequence[Finding] = ()
    document: Mapping[str, Any] = field(default_factory=dict)
    head: Head = field(default_factory=Head)
    make_sections: Callable[[], Sequence[Section]] = tuple
    provenance: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def page(self) -> str:
        """The page, HTML that refers to no other file."""
        return attribute("flagdata.pages.answer_page:render_answer")(self)

    def save(self, path: Path | str) -> Path:
        """Write the page to a file, in place of an earlier page there. Returns its path.

        Raises:
            ConflictError: something else is there.
            FlagdataError: it cannot be written.
        """
        from flagdata.core.files.outputs import write_file

        write_file(Path(path), self.page, command=self.question)
        return Path(path)

    def save_zarr(self, folder: Path | str) -> Path:
        """Write its arrays and its document as a new Zarr folder, which xarray opens as `to_xarray`
        returns it. Returns its path.

        Raises:
            UsageError: it has no arrays.
            ConflictError: something else is there.
            FlagdataError: it cannot be written.
        """
        self._check_arrays()
        import zarr

        from flagdata.core.files.outputs import fresh_folder

        with fresh_folder(Path(folder)) as scratch:
            group = zarr.open_group(scratch, mode="w-", zarr_format=3)
            coordinates = [name for name, one in self.arrays.items() if one.coordinate]
            document = {"document": dict(self.document), "coordinates": " ".join(coordinates)}
            group.update_attributes({**self._about, **document})
            for name, one in self.arrays.items():
                values, units = one.values, one.unit
                if values.dtype.kind == "M":
                    values, units = values.astype("datetime64[ns]").astype(np.int64), _INSTANTS
                array = group.create_array(name, data=values, dimension_names=one.dimensions)
                array.update_attributes({"units": units, "long_name": one.about})
        return Path(folder)

    def to_xarray(self) -> xr.Dataset:
        """Return its arrays as a data set, with units and meanings as attributes.

        Raises:
            UsageError: it has none.
            MissingExtraError: xarray is not installed.
        """
        self._check_arrays()
        from flagdata.core.extras import explaining_missing

        with explaining_missing():
            import xarray as xr

        variables = {
            name: xr.Variable(
                one.dimensions, one.values, {"units": one.unit, "long_name": one.about}
            )
            for name, one in self.arrays.items()
        }
        coordinates = {name for name, one in self.arrays.items() if one.coordinate}
        return xr.Dataset(variables, attrs=self._about).set_coords(coordinates)

    @property
    def _about(self) -> dict[str, str]:
        """What a data set of it states."""
        return {"question": self.question, "subject": self.subject, "answer": self.sentence}

    def _check_arrays(self) -> None:
        if not self.arrays:
            raise UsageError(
                "the answer has no arrays", where=self.subject, fix="take its `quantities`"
            )

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.sentence})"

    def _repr_html_(self) -> str:
        from flagdata.core.html import table

        rows = {one.title: one.text for one in self.quantities.values()}
        found = {f"{one.severity.value} {one.kind}": one.what for one in self.findings}
        return table(self.sentence, rows | found)
