"""Fills a page's template. What comes out is one file that refers to no other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


def render(
    package: str,
    template: str,
    values: Mapping[str, Any],
    *,
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> str:
    """Renders the page that `template` of `package` makes of `values`.

    Templates extend "base.html.j2" and may use `filters`. Values are escaped unless they are
    `Markup`; a name the template uses and `values` lacks is an error.
    """
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=ChoiceLoader([PackageLoader(package, "."), PackageLoader("flagdata.pages", ".")]),
    )
    environment.filters.update(filters or {})
    environment.globals["base_style"] = Markup(text_of("flagdata.pages", "base.css"))
    return environment.get_template(template).render(**values)


def text_of(package: str, name: str) -> str:
    """Reads a style, script or other text that a package brings along."""
    return files(package).joinpath(name).read_text(encoding="utf-8")
