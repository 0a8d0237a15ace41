"""Tables of tracked points, one row a marker and frame."""

from flagdata.ingest.markers.marker_table import COLUMNS, MarkerOptions, is_marker_table, read_table

__all__ = ["COLUMNS", "MarkerOptions", "is_marker_table", "read_table"]
