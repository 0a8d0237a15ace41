"""The page of a lake, `flagdata view`: read-only, on this machine alone, with no part from anywhere
else.

films (what moves, as pictures) → media (thumbnails, frames, winds as answers) → pages (HTML) →
routes (addresses to answers, without a socket) → server (the socket and who may ask).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.view.media import Media
    from flagdata.view.pages import Site
    from flagdata.view.server import Server, ServerAnswer, answer

__getattr__ = lazy_exports(__name__, __file__)
