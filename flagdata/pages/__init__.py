"""The kit of all reports: one frame and style, escaped text, tables, figures and pictures inside a
single HTML file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.pages.graph import COLOURS
    from flagdata.pages.lineage_picture import picture
    from flagdata.pages.page_pictures import moving

__getattr__ = lazy_exports(__name__, __file__)
