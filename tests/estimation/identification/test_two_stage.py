"""Closed loops: a reference removes the bias."""

import numpy as np
import pytest

from estimation.identification.notes import IdentificationCode
from estimation.identification.two_stage import identify_columns
from plant.errors import HydrostateError
from plant.log.record import Record

FORM = {"order": 1, "delay": 1}


def closed_loop(seed: int, n: int = 600, gain: float = 2.0) -> Record:
    """Return a log of y = 0.2 q^-1 / (1 - 0.8 q^-1) u + coloured noise, with u = r - gain q^-1 y."""
    rng = np.random.default_rng(seed)
    r, white = np.repeat(rng.choice([-1.0, 1.0], n // 20), 20), 0.2 * rng.normal(size=n)
    u, y, x, noise = np.zeros(n), np.zeros(n), 0.0, 0.0
    for t in range(n):
        noise = 0.9 * noise + white[t]
        y[t] = x + noise
        u[t] = r[t] - gain * y[t - 1]
        x = 0.8 * x + 0.2 * u[t]
    return Record(0.01, {"r": r, "u": u, "y": y, "other": rng.normal(size=n)})


def gain_of(record: Record, references: tuple[str, ...]) -> float:
    (found,), _ = identify_columns([record], ["u"], ["y"], references=references, options=FORM)
    ((b, f),) = found.model.transfer_functions()
    return float(b.sum() / f.sum())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_a_reference_removes_the_bias_of_a_closed_loop() -> None:
    told = np.array([[gain_of(record, names) for names in ((), ("r",))] for record in map(closed_loop, range(3))])
    alone, staged = told.mean(axis=0) - 1.0
    # over 20 seeds the gains are 0.58 ± 0.16 and 0.99 ± 0.22
    assert alone < -0.3
    assert abs(staged) < 3.0 * 0.22 / np.sqrt(3.0)


def test_the_share_of_the_input_explained_by_the_reference_is_noted_and_the_fit_is_rated_on_it() -> None:
    (found,), (data,) = identify_columns([closed_loop(1)], ["u"], ["y"], references=["r"], options=FORM)
    # the measured input contains noise that is already in the output
    assert found.quality.fit_percent > found.model.quality(data.u, data.y).fit_percent + 10.0
    assert found.sound
    (note,) = [one for one in found.notes if one.code == IdentificationCode.TWO_STAGES]
    assert (note.data["input"], note.data["reference"]) == ("u", "r")
    assert 0.1 < note.data["share"] < 0.9


def test_a_reference_that_does_not_drive_the_input_or_is_the_output_is_refused() -> None:
    with pytest.raises(HydrostateError, match="does not follow the reference other"):
        identify_columns([closed_loop(1, 200)], ["u"], ["y"], references=["other"])
    with pytest.raises(HydrostateError, match="neither input nor output"):
        identify_columns([closed_loop(1)], ["u"], ["y"], references=["y"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_the_deviation_of_a_gain_counts_what_the_first_stage_leaves_uncertain() -> None:
    found = [
        identify_columns([closed_loop(seed)], ["u"], ["y"], references=["r"], options=FORM)[0][0] for seed in range(8)
    ]
    models = [one.model.linear for one in found]
    deviations = [(one.dc_gain - 1.0) / one.dc_gain_std for one in models if one is not None]
    assert len(deviations) == 8
    # without the first stage 2.5
    assert 0.5 < float(np.sqrt(np.mean(np.square(deviations)))) < 1.8


def test_the_deviation_of_a_gain_over_the_gain_does_not_depend_on_the_inputs_unit() -> None:
    record, shares = closed_loop(1, 200), list[float]()
    for unit in (1.0, 1e3):
        given = record.replace(u=unit * record["u"])
        (found,), _ = identify_columns([given], ["u"], ["y"], references=["r"], options=FORM)
        assert found.model.linear is not None
        shares.append(found.model.linear.dc_gain_std / found.model.linear.dc_gain)
    assert shares[1] == pytest.approx(shares[0], rel=1e-6)
