import numpy as np

from faults.watch.events import change_time


def test_the_change_time_is_the_start_of_the_raised_scores() -> None:
    scores = np.concatenate([np.full(12, 3.0), np.zeros(40)])
    found, (least, most) = change_time(scores)
    assert found == 12
    assert least <= 12 <= most
