from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.work_limit import Work, WorkSpentError, spend

LOG: Any = SimpleNamespace(steps=np.full(10, 4))


def test_runs_are_counted_in_steps_of_the_model() -> None:
    work = Work(most=1000)
    with work.counted():
        spend(LOG, 16)
        spend(LOG)
    assert work.done == 17 * 40


def test_a_run_that_would_exceed_the_work_limit_is_not_begun() -> None:
    work = Work(most=100)
    with work.counted():
        spend(LOG, 2)
        with pytest.raises(WorkSpentError):
            spend(LOG, 1)
    assert work.done == 80


def test_a_second_count_continues_from_the_work_that_was_done() -> None:
    work = Work(most=100)
    with work.counted():
        spend(LOG, 2)
    spend(LOG, 1000)  # not counted
    with pytest.raises(WorkSpentError), work.counted():
        spend(LOG)
