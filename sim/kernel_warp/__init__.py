"""The base model's leapfrog steps as a Warp kernel, for graphics processors; it needs the extra
`flagdata[gpu]`.

- `leapfrog`: the kernel; imports warp.
- `batch`: hands a system's tensors to it; imports warp only where it is asked for.
"""
