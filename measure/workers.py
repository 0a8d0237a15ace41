"""What worker processes begin with."""

from __future__ import annotations

import os
import threading
from multiprocessing import parent_process


def single_threaded() -> None:
    """Limits a worker to one thread, since there are as many workers as cores, and to its parent's life, however that
    ends."""
    import torch

    torch.set_num_threads(1)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
