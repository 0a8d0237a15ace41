"""MCAP files of other programs: pictures of one topic as a camera's film, numbers of one topic as an anemometer's log.

Messages are read that are protobuf, JSON or ROS 2's CDR, chunks of any compression that MCAP names. Records that
flagdata wrote are no such files: they come in as what they are, see `flagdata.ingest.records`.
"""
