"""Camera files: any container that FFmpeg opens, to gray squares on an exact grid of instants.

`open_camera` gives the frames, `probe` what the file says of itself.
"""

from flagdata.ingest.camera.options import CameraOptions, Crop, CropBox, Limits, parse_crop
from flagdata.ingest.camera.stream import CameraStream, open_camera

__all__ = ["CameraOptions", "CameraStream", "Crop", "CropBox", "Limits", "open_camera", "parse_crop"]
