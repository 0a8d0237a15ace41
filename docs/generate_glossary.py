"""The glossary of the reports, docs/glossary.md: `python -m docs.generate_glossary`."""

from __future__ import annotations

from pathlib import Path

from flagdata.pages.glossary import GLOSSARY

PAGE = Path(__file__).with_name("glossary.md")
_HEAD = """\
# Glossary

Terms of the reports, pages and messages, as each report has them at its end. This page is generated.
"""


def reference() -> str:
    """The page."""
    return "\n".join([_HEAD, *(f"**{term}**\n: {meaning}\n" for term, meaning in GLOSSARY.items())])


if __name__ == "__main__":
    PAGE.write_text(reference(), encoding="utf-8")
