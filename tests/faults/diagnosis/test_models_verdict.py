"""The verdict from nine model errors alone: a class, no class, or no model that fits."""

import math

import numpy as np
import pytest

from estimation.finding import Outcome
from faults.conditions import CONDITIONS
from faults.diagnosis.models_verdict import error_margin, models_verdict, ranked_conditions
from faults.diagnosis.rmse import Scores
from faults.notes import AgainstCode, ClassCode
from plant.log.record import Record

PRESSURE = "differential_pressure_pa"
RECORD = Record(
    1e-3, {"motor_speed_rad_s": np.ones(100), "velocity_m_s": np.full(100, 0.1), PRESSURE: np.full(100, 1e5)}
)


def scored(*least: float, channels: int = 1, rest: float = 0.09) -> Scores:
    values = dict(zip(CONDITIONS, [*least, *[rest] * (len(CONDITIONS) - len(least))], strict=True))
    names = ("velocity_m_s", PRESSURE)[:channels]
    return Scores(values, dict.fromkeys(names, values))


def test_models_are_ranked_by_error_with_diverged_models_last() -> None:
    order = ranked_conditions(scored(0.02, math.inf, 0.01))
    assert [name for name, _ in order[:2]] == [list(CONDITIONS)[2], next(iter(CONDITIONS))]
    assert order[-1][0] == list(CONDITIONS)[1]


@pytest.mark.parametrize(
    ("least", "wanted"),
    [((0.01, 0.02), 2.0), ((0.0, 0.02), math.inf), ((0.0, 0.0), 1.0), ((0.03, math.inf), 3.0)],
)
def test_the_margin_is_the_error_of_the_runner_up_over_that_of_the_best(
    least: tuple[float, float], wanted: float
) -> None:
    assert error_margin(scored(*least)) == pytest.approx(wanted)


def test_the_outcome_is_diverged_if_every_model_diverged() -> None:
    found = models_verdict(scored(rest=math.inf), RECORD)
    assert (found.outcome, [note.code for note in found.notes]) == (Outcome.DIVERGED, [ClassCode.MODELS_DIVERGED])


@pytest.mark.parametrize(
    ("runner_up", "outcome"), [(1.0005, Outcome.NOT_OBSERVABLE), (1.002, Outcome.OK), (2.0, Outcome.OK)]
)
def test_models_whose_errors_differ_by_less_than_a_thousandth_are_indistinguishable(
    runner_up: float, outcome: Outcome
) -> None:
    found = models_verdict(scored(0.01, 0.01 * runner_up), RECORD)
    assert found.outcome is outcome
    assert [note.code for note in found.notes] == ([] if outcome is Outcome.OK else [ClassCode.MODELS_ALIKE])
    assert found.against == ()


def test_channels_that_are_0_throughout_are_named_and_give_no_class() -> None:
    still, moved = np.zeros(100), RECORD["velocity_m_s"]
    for velocity, named in ((still, f"velocity_m_s and {PRESSURE}"), (moved, PRESSURE)):
        log = RECORD.replace(velocity_m_s=velocity, differential_pressure_pa=still)
        found = models_verdict(scored(0.01, channels=2), log)
        assert found.outcome is Outcome.NOT_OBSERVABLE
        assert found.notes == (ClassCode.CHANNEL_ZERO.note(channels=named),)


@pytest.mark.parametrize(("share", "said"), [(0.45, False), (0.55, True)])
@pytest.mark.parametrize("channels", [1, 2])
def test_no_model_fits_if_the_best_leaves_more_than_half_of_the_signal(share: float, said: bool, channels: int) -> None:
    # the error of one channel has its unit, those of two are already shares
    least = share * (0.1 if channels == 1 else 1.0)
    found = models_verdict(scored(least, channels=channels, rest=2.0), RECORD)
    assert [note.code for note in found.against] == ([AgainstCode.NONE_FITS] if said else [])
    if said:
        assert found.against[0].data["percent"] == pytest.approx(55.0)


@pytest.mark.parametrize(
    ("least", "rest", "outcome"),
    [
        ((0.8, 0.8001), 0.95, Outcome.OK),
        ((0.8, 0.8001), 0.8002, Outcome.NOT_OBSERVABLE),
        ((0.3, 0.3001), 0.95, Outcome.NOT_OBSERVABLE),
        ((0.8, 0.8001), math.inf, Outcome.NOT_OBSERVABLE),
    ],
)
def test_if_no_model_fits_there_is_no_class_only_if_all_errors_are_alike(
    least: tuple[float, float], rest: float, outcome: Outcome
) -> None:
    """Under a load, two different models left 77.6 % each, and the others 80 to 96 %."""
    assert models_verdict(scored(*least, channels=2, rest=rest), RECORD).outcome is outcome
