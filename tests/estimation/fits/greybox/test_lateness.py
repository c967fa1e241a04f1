"""Channels that are slightly late or early, and a speed that leads position and pressure."""

import numpy as np
import pytest

from estimation.eha.explanation_notes import corrected_log, notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.lateness import LEAST_LATE, latest_channel
from estimation.fits.hypotheses import LATEST
from estimation.log_checks.clean import clean_log
from estimation.notes import RigCode
from tests.estimation.fits.strange_logs import HEALTHY, SPEED, explained, log


def test_the_latest_channel_is_the_one_that_gains_most_if_its_delay_is_plausible() -> None:
    late = {"motor_speed_rad_s": (-3e-3, 12.0), "position_m": (1e-3, 9.0)}
    assert latest_channel(late) == ("motor_speed_rad_s", -3e-3, 12.0)
    assert latest_channel({}) == ("", 0.0, 0.0)
    for behind, gain in ((0.9 * LEAST_LATE, 0.0), (1.1 * LEAST_LATE, 30.0), (-0.9 * LATEST, 30.0), (1.1 * LATEST, 0.0)):
        assert latest_channel({"position_m": (behind, 30.0)}) == ("position_m", behind, gain)


def test_a_speed_ahead_of_position_and_pressure_is_identified_and_shifted_back() -> None:
    record = log()
    ahead = np.concatenate([record[SPEED][3:], np.full(3, record[SPEED][-1])])
    given = record.replace(**{SPEED: ahead})
    found = explained(given)
    assert found.names == ("speed_early",)
    (note,) = notes_of(found, HEALTHY)
    assert note.code is RigCode.INPUT_EARLY
    assert note.data["early_ms"] == pytest.approx(3.0, abs=0.1)
    back = corrected_log(clean_log(given, HEALTHY), found).record[SPEED]
    assert np.std((back - record[SPEED])[:-3]) < 0.1 * np.std(ahead - record[SPEED])


def test_a_position_late_by_half_a_millisecond_is_identified() -> None:
    record = log(duration=3.0)
    rows = np.arange(len(record))
    given = record.replace(position_m=np.interp(rows - 0.5, rows, record["position_m"]))
    fit = fit_flow(given, HEALTHY, HEALTHY.bulk_modulus)
    assert fit.explanation is not None
    assert fit.explanation.names == ("position_late",)
    assert notes_of(fit.explanation, HEALTHY)[0].data["late_ms"] == pytest.approx(0.5, abs=0.25)
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - HEALTHY.bulk_modulus) < 2.0 * std
