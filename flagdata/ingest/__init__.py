"""Vendor files to typed signals: one package or module a family of source formats; units, frame and time fixed once."""

import sys

from flagdata.verb_package import VerbPackage

_VERB = "flagdata.api.recording_verbs:ingest"
sys.modules[__name__].__class__ = VerbPackage
