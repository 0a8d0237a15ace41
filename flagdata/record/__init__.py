"""Records: frames, wind, parameters and their provenance on one clock, one MCAP file each
(https://mcap.dev/spec).

    topic (schema.TOPIC_…)  schema, protobuf                    one message is
    /camera/image           foxglove.CompressedImage            a JPEG, gray
                            or foxglove.CompressedVideo         an H.264 picture, see `video`
    /wind/samples           flagdata.WindSample                 a sample with its flags
    /wind/1hz               flagdata.WindMean                   the mean of a second, with its σ
    /truth/parameters       flagdata.TruthParameters            what a simulation was made with

`log_time` is the record's common clock, `publish_time` the device's own, a message's `timestamp`
mid-exposure (frames), the sample's instant, or the END of the mean's second, on the common clock;
all UTC nanoseconds. In a camera or wind artifact both clocks are the device's. A field of a
WindSample that is absent was not measured; NaN is a value that is missing. Units and conventions
are in the comments of the schemas, inside the file.

Metadata records: "camera", "sensor", "provenance", "clock/<device>" (a ClockModel as JSON),
"salvage/<n>" (what a salvage lost). Attachments are the vendor's log, the sensor recipe that was
named, pictures; a media type ending in "+gzip" says that it was packed on writing.

Chunks are not compressed (JPEG and H.264 do not shrink further), so that a frame is read from its
place in the file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.record.reader import Record
from flagdata.record.salvage import salvage
from flagdata.record.writer import Chunking, Coding, RecordWriter

if TYPE_CHECKING:
    from flagdata.record.mcap_container import read_messages, read_summary
    from flagdata.record.metadata import CAMERA, PROVENANCE
    from flagdata.record.reader import Record
    from flagdata.record.record_bytes import open_bytes
    from flagdata.record.record_checksums import CHECKSUMS, ChecksummedFile
    from flagdata.record.unpacking import unpack_chunk
    from flagdata.record.video_archive import VideoEncoder, decode
    from flagdata.record.writer import Chunking, Coding, RecordWriter


__all__ = ["Chunking", "Coding", "Record", "RecordWriter", "salvage"]

__getattr__ = lazy_exports(__name__, __file__)
