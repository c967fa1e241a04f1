"""Memory of a process that answers for one log: what is freed stays with it, ready to be used again."""

import ctypes

TRIM, MMAP, ARENAS = -1, -3, -8
"""Numbers of the options of `mallopt` (malloc.h of the GNU C library)."""

LARGEST_KEPT, MOST_KEPT = 32 << 20, 1 << 30
"""Largest block that is not given back at once, and how much free memory at the end is kept [bytes]; the first is the
most that the library takes."""


def keep_freed_memory() -> bool:
    """Let the C library keep what is freed, in one pool for all threads.

    By default each array of over 128 kB gets pages of its own from the system, which clears them: with 200,000 rows
    that is half of a second's page faults.

    Returns
    -------
    bool
        Whether the library took it; others than GNU's have no such options.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    taken = [mallopt(option, value) for option, value in ((MMAP, LARGEST_KEPT), (TRIM, MOST_KEPT), (ARENAS, 1))]
    return all(one == 1 for one in taken)
