"""A page stores numbers in 16 bits each, and long series as extremes."""

import zlib
from base64 import b64decode

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from experiments.page.packed import MISSING, ends_of_stretches, packed_series, stretch_length
from plant.arrays import Array


def unpacked(one: dict[str, object]) -> Array:
    """Return a series as the script of a page unpacks it."""
    data = zlib.decompress(b64decode(str(one["data"])), -zlib.MAX_WBITS)
    with np.errstate(over="ignore"):
        codes = np.cumsum(np.frombuffer(data, "<i2"), dtype=np.int16)
    values = float(str(one["middle"])) + float(str(one["quantum"])) * codes.astype(np.float64)
    return np.where(codes == MISSING, np.nan, values)


@given(arrays(np.float64, st.integers(1, 300), elements=st.floats(-1e9, 1e9) | st.just(float("nan"))))
def test_a_packed_series_is_restored_to_within_half_a_quantum_with_its_gaps(values: Array) -> None:
    one = dict(packed_series(values))
    back = unpacked(one)
    assert np.array_equal(np.isnan(back), np.isnan(values))
    there = np.isfinite(values)
    allowed = 0.5 * one["quantum"] * (1.0 + 1e-6) + 1e-6
    assert np.all(np.abs(back[there] - values[there]) <= allowed)


def test_a_packed_series_without_values_is_restored_as_gaps() -> None:
    assert np.all(np.isnan(unpacked(dict(packed_series(np.full(5, np.nan))))))


@given(arrays(np.float64, st.integers(1, 2000), elements=st.floats(-1e6, 1e6)), st.integers(2, 200))
def test_reducing_a_series_keeps_its_extremes_within_the_allowed_number_of_points(values: Array, most: int) -> None:
    ends = ends_of_stretches(values, most)
    assert len(ends) <= most
    assert (np.nanmin(ends), np.nanmax(ends)) == (values.min(), values.max())
    assert (stretch_length(len(values), most) == 1) == (len(values) <= most)


def test_a_stretch_without_samples_is_a_gap() -> None:
    values = np.array([1.0, 2.0, np.nan, np.nan, 5.0, 4.0])
    assert np.array_equal(ends_of_stretches(values, 4), [1.0, 2.0, 5.0, 4.0], equal_nan=True)
    assert np.isnan(ends_of_stretches(np.array([1.0, 2.0, np.nan, np.nan, 5.0, 4.0, 7.0, 8.0]), 8)[2])
