"""A process started by a server: its linear algebra uses one thread, and it ends with the server."""

import os
import threading
import time

CHECK_INTERVAL = 1.0
"""Time between two checks whether the server still runs [s]."""


def bind_to_server(server: int) -> None:
    """Make this process end with its server, before it imports libraries for computing."""
    for name in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    threading.Thread(target=_exit_with_server, args=(server,), daemon=True).start()


def _exit_with_server(server: int) -> None:
    while os.getppid() == server:
        time.sleep(CHECK_INTERVAL)
    os._exit(1)
