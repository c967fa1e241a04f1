"""Numbers of a chart as stored in a page: 16-bit steps, compressed; long series as the extremes of each interval."""

import zlib
from base64 import b64encode
from collections.abc import Mapping
from typing import Any

import numpy as np

from plant.arrays import Array

CODES_PER_SIDE = 32_500
"""Steps on each side of the middle of the value range [count]."""

MISSING = -32_768
"""Code of a missing value."""


def packed_series(values: Array) -> Mapping[str, Any]:
    """Return a series in a form for JSON.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The series [its unit]; values that are not finite count as missing.

    Returns
    -------
    Mapping[str, Any]
        ``data``: differences of 16-bit codes, deflated and in base64. A value is ``middle + quantum * code``, accurate
        to half a ``quantum``, which is the range divided by 65,000 [its unit].

    Examples
    --------
    >>> one = packed_series(np.array([0.0, 1.0]))
    >>> one["middle"], one["quantum"] == 1.0 / 65000.0
    (0.5, True)
    """
    there = np.isfinite(values)
    low, high = (float(end) for end in (values[there].min(), values[there].max())) if np.any(there) else (0.0, 0.0)
    middle = low + 0.5 * (high - low)
    quantum = (high - low) / (2.0 * CODES_PER_SIDE) or 1.0
    scaled = np.rint((np.where(there, values, middle) - middle) / quantum)
    codes = np.where(there, np.clip(scaled, -CODES_PER_SIDE, CODES_PER_SIDE), MISSING).astype("<i2")
    with np.errstate(over="ignore"):  # steps overflow; so does their sum in the page, which restores the codes
        steps = np.diff(codes, prepend=np.zeros(1, codes.dtype))
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    data = deflate.compress(steps.astype("<i2").tobytes()) + deflate.flush()
    return {"middle": middle, "quantum": quantum, "data": b64encode(data).decode("ascii")}


def ends_of_stretches(values: Array, most: int) -> Array:
    """Return the minimum and maximum of each interval of a series, in time order.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The series [its unit]; NaN is missing.
    most : int
        Largest number of values wanted, at least two [count].

    Returns
    -------
    ndarray, shape (m,)
        The unchanged series if it is short enough, else two values for each interval, which keep every peak.

    Examples
    --------
    >>> ends_of_stretches(np.array([0.0, 5.0, 1.0, 1.0, -3.0, 2.0]), 4).tolist()
    [0.0, 5.0, -3.0, 2.0]
    """
    length = stretch_length(len(values), most)
    if length == 1:
        return values
    filled = np.full(-(-len(values) // length) * length, np.nan)
    filled[: len(values)] = values
    rows = filled.reshape(-1, length)
    there = np.isfinite(rows)
    lowest = np.argmin(np.where(there, rows, np.inf), axis=1)
    highest = np.argmax(np.where(there, rows, -np.inf), axis=1)
    order = np.sort(np.column_stack([lowest, highest]), axis=1)
    return np.take_along_axis(rows, order, axis=1).ravel()


def stretch_length(count: int, most: int) -> int:
    """Return the number of samples in each interval of `ends_of_stretches`; 1 if all are kept."""
    return 1 if count <= most else -(-count // (most // 2))
