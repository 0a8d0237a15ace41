"""Vendor files to typed signals: one package or module a family of source formats; units, frame and
time fixed once."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.packages.verb_package import VerbPackage

if TYPE_CHECKING:
    from flagdata.ingest.anemometer.anemometer_log import read_log
    from flagdata.ingest.anemometer.draft.drafting import draft
    from flagdata.ingest.anemometer.draft.questions import OpenFactsError
    from flagdata.ingest.anemometer.formats.log_formats import FORMATS
    from flagdata.ingest.anemometer.formats.nmea_sentences import checksum
    from flagdata.ingest.anemometer.identify import anemometers, sniff
    from flagdata.ingest.anemometer.instants.log_clock import ClockChoice
    from flagdata.ingest.anemometer.log_confirmation import (
        UNASKED,
        Accepting,
        Drafted,
        UnconfirmedError,
    )
    from flagdata.ingest.anemometer.log_reading import Reading
    from flagdata.ingest.anemometer.samples.rules import gaps
    from flagdata.ingest.anemometer.sensor_recipe import FileLayout, QualityRules
    from flagdata.ingest.anemometer.sniffing import Head
    from flagdata.ingest.anemometer.text.opening import open_text
    from flagdata.ingest.anemometer.wind_options import WindOptions
    from flagdata.ingest.artifacts_present import IngestResult, Labels
    from flagdata.ingest.camera.camera_options import CameraOptions, CropBox, parse_crop
    from flagdata.ingest.camera.camera_probing import probe
    from flagdata.ingest.camera.stream import open_camera, propose_crop
    from flagdata.ingest.classification import classify, guesses
    from flagdata.ingest.cloth_films import read_cloths
    from flagdata.ingest.foreign import examine
    from flagdata.ingest.markers.marker_artifacts import ingest_markers
    from flagdata.ingest.markers.marker_table import MarkerOptions, is_marker_table, read_table
    from flagdata.ingest.mcap.topics import messages, topics
    from flagdata.ingest.meshes.folder import frame_files, read_folder, read_json, write_folder
    from flagdata.ingest.meshes.mesh_artifacts import (
        MeshIngest,
        findings,
        ingest_meshes,
        scene_wind,
    )
    from flagdata.ingest.meshes.wavefront import Obj, obj_text, read_obj, write_obj
    from flagdata.ingest.records import ingest_record
    from flagdata.ingest.source_artifacts import (
        CameraIngest,
        WindIngest,
        ingest_camera,
        ingest_wind,
    )

__getattr__ = lazy_exports(__name__, __file__)
_VERB = "flagdata.api.recording_verbs:ingest"
sys.modules[__name__].__class__ = VerbPackage
