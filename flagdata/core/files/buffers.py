"""Bytes for Arrow's threads.

Arrow reads Parquet and CSV on threads of its own, which let go of what they read shortly after they
have given the result. Memory that belongs to a Python object can only be let go with the
interpreter's lock. Where the interpreter ends at that moment, Python ends the thread that asks for
the lock, and C++ aborts the process: "terminate called without an active exception", exit code 134
(apache/arrow issue 34314).
"""

from __future__ import annotations

import pyarrow as pa


def own_copy(data: bytes) -> pa.Buffer:
    """Copies the bytes to memory of Arrow's own, which its threads let go without the
    interpreter."""
    content = pa.allocate_buffer(len(data))
    if data:
        pa.FixedSizeBufferWriter(content).write(data)
    return content
