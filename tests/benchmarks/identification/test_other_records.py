"""Other records of a plant tell a default that is worse than a baseline from one that was unlucky in one test."""

import numpy as np
import pytest

from benchmarks.identification.identification_sets_data import Part, PublicSet
from benchmarks.identification.other_records import OtherRecords
from estimation.arrays import Array


def of_records(
    count: int, sizes: dict[str, float], *, spread: float = 0.0
) -> tuple[PublicSet, dict[str, dict[str, Array]]]:
    """Return a set with other records, and runs of models with errors of the given sizes."""
    rng = np.random.default_rng(0)
    parts: dict[str, Part] = {f"record {k}": (np.zeros((200, 1)), rng.normal(size=200)) for k in range(count)}
    runs = {
        model: {key: y + size * np.exp(spread * rng.normal()) * rng.normal(size=200) for key, (_, y) in parts.items()}
        for model, size in sizes.items()
    }
    one = PublicSet("plant", True, 1.0, (np.zeros((10, 1)), np.zeros(10)), {}, 5, parts)
    return one, runs


@pytest.mark.parametrize(
    ("default", "spread", "said"),
    [
        (1.5, 0.0, "1 of 1 surely worse by over 2 %, 0 perhaps, 0 surely better"),
        (0.7, 0.0, "0 of 1 surely worse by over 2 %, 0 perhaps, 1 surely better"),
        (1.6, 1.0, "0 of 1 surely worse by over 2 %, 1 perhaps, 0 surely better"),
    ],
)
def test_a_difference_is_sure_only_if_the_other_records_agree(default: float, spread: float, said: str) -> None:
    others = OtherRecords()
    (line,) = others.comparison_lines(*of_records(16, {"default": default, "first": 1.0}, spread=spread))
    assert line.startswith("default over first ")
    (summary,) = others.summary()
    assert said in summary


def test_a_run_that_turns_nan_has_an_infinite_error() -> None:
    one, runs = of_records(4, {"default": 1.0, "auto": 1.0})
    runs["auto"]["record 0"][50:] = np.nan
    (line,) = OtherRecords().comparison_lines(one, runs)
    assert line.startswith("auto over default inf")


def test_a_set_without_other_records_has_no_line() -> None:
    one, runs = of_records(0, {"default": 1.0, "first": 1.0})
    others = OtherRecords()
    assert not others.comparison_lines(one, runs)
    assert not others.summary()
