"""Formulas of the site: TeX between dollar signs becomes MathML while the site is built.

Browsers set MathML by themselves, so that a page needs no script and no font for it, also opened as
a file, and one without formulas carries nothing; MathJax or KaTeX would be megabytes of scripts and
fonts beside the pages. GitHub sets the same TeX where it shows docs/; commands that its Markdown
takes for escapes, such as a thin space, are avoided.
"""

from __future__ import annotations

import html
import re

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.pages import Page

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)


def on_page_content(text: str, page: Page, **_: object) -> str:
    """The page's HTML with its formulas set; called by MkDocs."""
    return formulas_set(text, page.file.src_uri)


def formulas_set(text: str, page: str) -> str:
    """HTML in which MathML stands for TeX as `pymdownx.arithmatex` marks it.

    Raises:
        PluginError: a command of TeX has no MathML; the text names the page.
    """
    return _FORMULA.sub(lambda found: _set(found[1], html.unescape(found[2]).strip(), page), text)


def _set(element: str, tex: str, page: str) -> str:
    block = element == "div"
    shown = convert(tex, display="block" if block else "inline")
    if unknown := re.findall(r"\\[a-zA-Z]*", shown):
        raise PluginError(
            f"{page}: {', '.join(unknown)} in the formula {tex} has no MathML; use another command"
        )
    return f'<div class="formula">{shown}</div>' if block else shown
