"""Camera files: any container that FFmpeg opens, and folders of images, to gray squares on an exact grid of instants.

`open_camera` gives the frames, `probe` what the file says of itself, `propose_crop` where its motion is.
"""

from flagdata.ingest.camera.motion import CropProposal
from flagdata.ingest.camera.options import CameraOptions, Crop, CropBox, Limits, parse_crop
from flagdata.ingest.camera.probe import CameraProbe, probe
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
