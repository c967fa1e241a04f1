"""Converts columns between NumPy and Arrow.

Arrow's own conversion imports pandas, which takes longer than reading a log.
"""

from typing import Any, cast

import numpy as np
import pyarrow as pa

from plant.arrays import Array


def from_arrow(column: "pa.ChunkedArray[Any]") -> Array:
    """Return an Arrow column as a new array, with NaN for missing values.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
        Of type float64.

    Returns
    -------
    ndarray, shape (n,)
        Its values.

    Examples
    --------
    >>> from_arrow(pa.chunked_array([[1.0, None], [2.0]])).tolist()
    [1.0, nan, 2.0]
    """
    out, end = np.empty(len(column)), 0
    for chunk in column.chunks:
        begin, end = end, end + len(chunk)
        # Arrow's buffers support the buffer protocol, which its stubs do not state
        there, values = (cast("Any", one) for one in chunk.buffers())
        if values is not None:
            out[begin:end] = np.frombuffer(values, dtype=np.float64)[chunk.offset : chunk.offset + len(chunk)]
        if chunk.null_count and there is not None:
            bits = np.unpackbits(np.frombuffer(there, dtype=np.uint8), bitorder="little")
            out[begin:end][bits[chunk.offset : chunk.offset + len(chunk)] == 0] = np.nan
    return out


def to_arrow(values: Array) -> "pa.Array[Any]":
    """Return an array as an Arrow column, with NaN as missing values.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Any column.

    Returns
    -------
    pyarrow.Array
        Of type float64.

    Examples
    --------
    >>> to_arrow(np.array([1.0, np.nan])).to_pylist()
    [1.0, None]
    """
    there: Any = np.packbits(~np.isnan(values), bitorder="little")
    numbers: Any = np.ascontiguousarray(values, dtype=np.float64)
    buffers: list[pa.Buffer | None] = [pa.py_buffer(there), pa.py_buffer(numbers)]
    return pa.Array.from_buffers(pa.float64(), len(values), buffers)
