"""Mesh sequences of other simulators: Wavefront OBJ files, and ArcSim output folders, of fixed or
changing topology."""

from flagdata.ingest.meshes.folder import frame_files, read_folder, write_folder
from flagdata.ingest.meshes.wavefront import Obj, obj_text, read_obj, write_obj

__all__ = ["Obj", "frame_files", "obj_text", "read_folder", "read_obj", "write_folder", "write_obj"]
