"""Copies of a selection for other ecosystems. A format is a module here and one line in `FORMATS`."""

from flagdata.export.plan import FORMATS, Export, ExportResult, Prepared, export, prepare

__all__ = ["FORMATS", "Export", "ExportResult", "Prepared", "export", "prepare"]
