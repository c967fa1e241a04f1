"""A process that a server begins: its linear algebra keeps to one thread, and it does not outlive the server."""

import os
import threading
import time

LOOKED_AFTER = 1.0
"""Time between two looks whether the server is still there [s]."""


def bind_to_server(server: int) -> None:
    """Bind this process to its server's life, before it loads what computes."""
    for name in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    threading.Thread(target=_end_with, args=(server,), daemon=True).start()


def _end_with(server: int) -> None:
    while os.getppid() == server:
        time.sleep(LOOKED_AFTER)
    os._exit(1)
