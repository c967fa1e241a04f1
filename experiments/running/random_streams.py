"""Named random streams: results do not depend on the order of cases or the number of workers."""

import zlib

import numpy as np


def stream(seed: int, *key: str | int) -> np.random.Generator:
    """Return the random generator of one case.

    Returns
    -------
    numpy.random.Generator
        The same for the same seed and key, whatever ran before.

    Examples
    --------
    >>> bool(stream(1, "normal").random() == stream(1, "normal").random())
    True
    """
    words = [part if isinstance(part, int) else zlib.crc32(part.encode()) for part in key]
    return np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=tuple(words)))
