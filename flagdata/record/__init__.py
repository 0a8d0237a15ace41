"""Records: frames, wind, parameters and their provenance on one clock, one MCAP file each."""

from flagdata.record.reader import Record
from flagdata.record.salvage import salvage
from flagdata.record.writer import Chunking, Coding, RecordWriter

__all__ = ["Chunking", "Coding", "Record", "RecordWriter", "salvage"]
