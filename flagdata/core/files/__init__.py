"""Files and folders at the boundary: addresses, writing that survives a crash, checksums, caches,
limits."""
