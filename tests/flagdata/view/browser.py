"""A browser that opens a page of `flagdata view` and answers a question about it from inside.

The question is a script that is sent with the page's own; it leaves its answer at an address of the
server. A picture that the server holds back until then keeps the browser from taking the page for
loaded.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from collections.abc import Mapping
from http import HTTPStatus
from pathlib import Path
from typing import Any

import pytest

from flagdata.lake import Lake
from flagdata.view import ServerAnswer, pages, server

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
_PATIENCE = 60.0  # s
_NARROWEST = 500  # px of a window; a narrower page is put into a frame

_ASKED = """
{
  const base = document.currentScript.src.replace("script.js", "");
  const held = new Image();
  held.hidden = true;
  held.src = base + "held";
  document.body.append(held);
  const until = async (is) => { while (!is()) await new Promise((go) => setTimeout(go, 20)); };
  const refused = [];
  addEventListener("securitypolicyviolation", (event) => refused.push(event.blockedURI));
  addEventListener("error", (event) => refused.push(event.message));
  (async () => {
    let found;
    try { found = await (async () => { QUESTION })(); } catch (error) { found = { failed: String(error) }; }
    const { scrollWidth, clientWidth } = document.documentElement;
    Object.assign(found, { refused, width: clientWidth, wide: scrollWidth - clientWidth });
    found.requests = performance.getEntriesByType("resource").map((one) => new URL(one.name).host);
    await fetch(base + "found?is=" + encodeURIComponent(JSON.stringify(found)));
  })();
}
"""


def asked(
    lake: Lake,
    path: str,
    question: str,
    *,
    folder: Path,
    width: int,
    height: int = 1000,
    screenshot: Path | None = None,
) -> dict[str, Any]:
    """What the script `question` returns in the page at a path, with its width, by how much it is
    wider than that, what the browser refused, and the hosts that were asked.

    Args:
        question: the body of an asynchronous function; `until(condition)` waits.
        folder: for the browser's profile.
        width, height: of the window [px].
        screenshot: where to keep a picture of the page.
    """
    assert BROWSER
    answers: list[dict[str, Any]] = []
    answered = threading.Event()

    def held(*_: object) -> ServerAnswer:
        answered.wait(_PATIENCE)
        return ServerAnswer(status=HTTPStatus.OK, media_type="image/svg+xml", content=pages.ICON)

    def found(site: object, groups: object, fields: Mapping[str, str]) -> ServerAnswer:
        answers.append(json.loads(fields["is"]))
        answered.set()
        return ServerAnswer(status=HTTPStatus.OK, media_type="text/plain", content=b"")

    script = pages.script() + _ASKED.replace("QUESTION", question).encode()

    def framed(*_: object) -> ServerAnswer:
        frame = (
            f'<!doctype html><body style="margin:0"><iframe src="{path or "./"}" width="{width}" '
            f'height="{height}" '
        )
        content = f'{frame}style="border:0"></iframe>'.encode()
        return ServerAnswer(status=HTTPStatus.OK, media_type="text/html", content=content)

    with pytest.MonkeyPatch.context() as patch, server.Server(lake) as served:
        patch.setattr(pages, "script", lambda: script)
        patch.setitem(server._ROUTES, "held", held)
        patch.setitem(server._ROUTES, "found", found)
        if width < _NARROWEST:
            policy = server.HEADERS["Content-Security-Policy"].replace(
                "frame-ancestors 'none'", "frame-src 'self'"
            )
            policy = policy.replace("style-src 'self'", "style-src 'self' 'unsafe-inline'")
            patch.setitem(server._ROUTES, "framed", framed)
            patch.setitem(server.HEADERS, "Content-Security-Policy", policy)
        threading.Thread(target=served.serve_forever, daemon=True).start()
        kept = f"--screenshot={screenshot}" if screenshot is not None else "--dump-dom"
        subprocess.run(
            [
                BROWSER,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--timeout=60000",
                f"--window-size={width},{height}",
                f"--user-data-dir={folder / 'profile'}",
                kept,
                served.address + (path if width >= _NARROWEST else "framed"),
            ],
            capture_output=True,
            check=True,
            timeout=300,
        )
        served.shutdown()
    assert answers, "the page did not answer"
    return answers[0]
