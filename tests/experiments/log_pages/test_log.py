"""A log in the hands of a Python user: as a table, and drawn."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import hydrostate as hs


@pytest.fixture(scope="module")
def log() -> hs.Log:
    return hs.simulate(duration=0.5, sample_time=1e-3)


def test_a_table_has_a_row_a_sample_by_time_and_a_column_a_channel(log: hs.Log) -> None:
    table = log.to_frame()
    assert table.index.name == "time_s"
    assert table.index.to_numpy() == pytest.approx(1e-3 * np.arange(len(table)))
    assert list(table) == list(log.channels)
    for name in log.channels:
        np.testing.assert_array_equal(table[name], log.record[name])


def test_every_channel_is_drawn_over_one_time_axis(log: hs.Log) -> None:
    axes = log.plot()
    try:
        assert [axis.get_ylabel() for axis in axes] == [name.replace("_", " ") for name in log.channels]
        assert [axis.get_xlabel() for axis in axes] == [""] * (len(axes) - 1) + ["time [s]"]
        for axis, name in zip(axes, log.channels, strict=True):
            np.testing.assert_array_equal(axis.lines[0].get_ydata(), log.record[name])
    finally:
        plt.close("all")
