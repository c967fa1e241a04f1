"""Least squares over the samples that are used."""

import numpy as np
import pytest

from estimation.identification.free_run.least_squares import MOST_PIECES, Counted, least_squares


@pytest.mark.parametrize("scattered", [False, True])
def test_unused_samples_do_not_affect_least_squares(scattered: bool) -> None:
    rng = np.random.default_rng(1)
    columns, target = rng.normal(size=(300, 4)), rng.normal(size=300)
    used = rng.random(300) < 0.5 if scattered else (np.arange(300) // 50) % 3 > 0
    counted = Counted(used)
    assert (len(counted.pieces) == 1) == scattered
    assert len(counted.pieces) <= MOST_PIECES
    gram, right = counted.normal_equations(columns, np.where(used, target, np.nan))
    assert gram == pytest.approx(columns[used].T @ columns[used])
    assert right == pytest.approx(columns[used].T @ target[used])
    assert counted.square(np.where(used, target, np.nan)) == pytest.approx(target[used] @ target[used])
    values, cost = least_squares(columns, np.where(used, target, np.nan), counted)
    wanted, squares = np.linalg.lstsq(columns[used], target[used], rcond=None)[:2]
    assert values == pytest.approx(wanted)
    assert cost == pytest.approx(squares[0])
