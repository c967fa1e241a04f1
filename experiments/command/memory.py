"""Memory of a process for one log: freed memory is kept for reuse."""

import ctypes

TRIM, MMAP, ARENAS = -1, -3, -8
"""Option numbers of `mallopt` (malloc.h of the GNU C library)."""

LARGEST_KEPT, MOST_KEPT = 32 << 20, 1 << 30
"""Largest block that is kept when freed, and how much free memory is kept at the end [bytes]; the first is the largest
value that the library accepts."""


def keep_freed_memory() -> bool:
    """Let the C library keep freed memory, in one pool for all threads.

    By default, each array over 128 kB gets its own pages from the system, which clears them. With 200,000 rows this
    costs half a second of page faults.

    Returns
    -------
    bool
        Whether the library accepted it; libraries other than GNU's have no such options.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    taken = [mallopt(option, value) for option, value in ((MMAP, LARGEST_KEPT), (TRIM, MOST_KEPT), (ARENAS, 1))]
    return all(one == 1 for one in taken)
