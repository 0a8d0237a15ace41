"""MCAP files of other programs: pictures of one topic as a camera's film, numbers of one topic as
an anemometer's log.

Messages are read that are protobuf, JSON, ROS 2's CDR or ROS 1, in chunks and outside them. Records
that
flagdata wrote are no such files: they come in as what they are, see `flagdata.ingest.records`.
"""
