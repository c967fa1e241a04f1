"""Nine filters on one log."""

from collections.abc import Iterable
from types import SimpleNamespace

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis import innovation_bank
from plant.eha.model import EhaParameters
from plant.log.record import Record


def test_filters_fill_more_than_half_of_the_kernels_lanes(monkeypatch: pytest.MonkeyPatch) -> None:
    used = []

    def filtered(problems: Iterable[object], lanes: int) -> list[SimpleNamespace]:
        run = [SimpleNamespace(log_likelihood=0.0) for _ in problems]
        used.append(len(run) / lanes)
        return run

    monkeypatch.setattr(innovation_bank, "filter_batch", filtered)
    still = np.zeros(100)
    log = Record(2e-3, {"motor_speed_rad_s": still, "velocity_m_s": still})
    assert innovation_bank.innovation_scores(log, EhaParameters()).shape == (len(CONDITIONS),)
    assert used[0] > 0.5
