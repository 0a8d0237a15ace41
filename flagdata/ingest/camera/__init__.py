"""Camera files: any container that FFmpeg opens, and folders of images, to gray squares on an exact
grid of instants.

`open_camera` gives the frames, `probe` what the file says of itself, `propose_crop` where its
motion is.

Kinds of findings, by severity:

- notes: resampled, frames-dropped, true-rate, variable-rate, exposure-unknown, crop-proposed,
  letterboxed (a chosen crop), enlarged (up to twice), mirrored, more-video-streams,
  telemetry-without-time, numbered-by-steps, start-by-gps, start-passed-over, chapter-placed,
  chapters-joined, files-not-read;
- warnings: crop-cuts-motion, letterboxed (no crop chosen), enlarged, frames-missing,
  frames-repeated, frames-not-shown, frames-undecoded, stamps-missing, stamps-duplicate,
  stamps-disordered, stamps-synthetic (of LeRobot data sets), true-rate-of-variable, start-unsure,
  start-unknown, chapter-not-placed, chapters-unproven, interlaced, odd-rotation, hdr-transfer,
  alpha-ignored, gif-delays, damaged-references, index-damaged, stream-appeared, side-not-stated,
  order-by-name, order-by-time, rate-unlike-names, depth-by-content, orientation-changed,
  edit-list-passed-over, capture-rate, truncated (within a transport packet);
- errors: truncated, corrupt-packets, corrupt-frames, size-changed, clock-reset, pages-not-read.

Names are imported when they are first used: ingesting an anemometer's log needs no video decoder.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.ingest.camera.camera_options import (
        CameraOptions,
        Crop,
        CropBox,
        Limits,
        parse_crop,
    )
    from flagdata.ingest.camera.camera_probing import CameraProbe, probe
    from flagdata.ingest.camera.motion_crop import CropProposal
    from flagdata.ingest.camera.stream import CameraStream, open_camera, propose_crop

__all__ = [
    "CameraOptions",
    "CameraProbe",
    "CameraStream",
    "Crop",
    "CropBox",
    "CropProposal",
    "Limits",
    "open_camera",
    "parse_crop",
    "probe",
    "propose_crop",
]

__getattr__ = lazy_exports(__name__, __file__)
