"""The text of small files that people write and programs of an office save: recipes, tables,
effects."""

from __future__ import annotations

import codecs

from flagdata.errors import InputError

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte-order marks and their codecs, which leave them out; the mark of UTF-16 begins that of
UTF-32."""


def encoding_of(head: bytes) -> str:
    """Finds the codec that the first bytes of a text state, UTF-8 where they state none."""
    return next((codec for mark, codec in _MARKS if head.startswith(mark)), "utf-8")


def plain_text(data: bytes, *, noun: str, where: str) -> str:
    """Decodes the text of a file, UTF-8 or what its byte-order mark says; where lines end in CR
    alone they end in LF.

    Args:
        noun: what the file is called in the error message.

    Raises:
        InputError: it is in no such encoding; the error names the line.
    """
    codec = encoding_of(data)
    try:
        text = data.decode(codec)
    except UnicodeDecodeError as error:
        line = data[: error.start].decode(codec, errors="replace").count("\n") + 1
        fix = "save it as UTF-8 (a spreadsheet's CSV UTF-8; Notepad's encoding UTF-8)"
        message = f"the {noun} is not {codec.removesuffix('-sig').upper()}, as line {line} shows"
        raise InputError(message, where=where, fix=fix) from None
    return text if "\n" in text else text.replace("\r", "\n")
