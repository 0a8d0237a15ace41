"""Copies of a selection for other ecosystems. A format is a module here and one line in
`FORMATS`."""

import sys

from flagdata.export.export_plan import FORMATS, Export, ExportResult, Prepared, export, prepare
from flagdata.packages.verb_package import VerbPackage

__all__ = ["FORMATS", "Export", "ExportResult", "Prepared", "export", "prepare"]

_VERB = "flagdata.api.lake_verbs:export"
sys.modules[__name__].__class__ = VerbPackage
