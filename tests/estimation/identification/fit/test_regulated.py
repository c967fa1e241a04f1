from typing import Any

import numpy as np
import pytest

from estimation.identification import identify_record
from estimation.identification.fit.regulated import TOLD, told_by_output
from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import LogWarning
from plant.log.record import Record

COUNT = 1_200
RNG_SEED = 470


def regulated_loop(
    seed: int, *, proportional: float = 2.0, integral: float = 0.1, late: int = 0, changes: int = 0, lag: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return input and output of y = 0.1 / (1 - 0.9 q^-1) q^-1 u + AR(1) noise under a PI controller, rounded."""
    rng = np.random.default_rng([RNG_SEED, seed])
    reference = np.repeat([0.0, *rng.uniform(-1.0, 1.0, changes)], COUNT // (changes + 1) + 1)[:COUNT]
    u, y, x, total, noise, moved = np.zeros(COUNT), np.zeros(COUNT), 0.0, 0.0, 0.0, 0.0
    for t in range(COUNT):
        noise = 0.9 * noise + 0.09 * rng.standard_normal()
        y[t] = x + noise
        error = reference[t] - (y[t - late] if t >= late else 0.0)
        total += integral * error
        moved = lag * moved + (1.0 - lag) * (proportional * error + total)
        u[t] = moved
        x = 0.9 * x + 0.1 * u[t]
    return np.round(u, 3), np.round(y, 3)


def open_loop(kind: str, noise: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng([RNG_SEED, 7])
    white, jumps = rng.standard_normal(COUNT), np.repeat(rng.choice([-1.0, 1.0], COUNT // 10), 10)
    u = {
        "white": white,
        "held": jumps,
        "behind a lag": filtered([0.3], [1.0, -0.7], jumps) + 1e-3 * white,
        "smooth": filtered([0.01], [1.0, -1.8, 0.81], white),
        "sine": np.sin(0.05 * np.arange(COUNT)),
    }[kind]
    y = filtered([0.0, 0.1], [1.0, -0.9], u)
    return u, y + noise * float(np.std(y)) * rng.standard_normal(COUNT)


LOOPS: dict[str, dict[str, Any]] = {
    "proportional": {"integral": 0.0},
    "integral": {},
    "a sample late": {"late": 1},
    "behind an actuator": {"lag": 0.8},
    "three set-points": {"changes": 3},
    "twenty set-points": {"changes": 20},
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_controller_at_set_points_that_stay_tells_its_input(name: str) -> None:
    assert told_by_output(*regulated_loop(1, **LOOPS[name])) < 0.3 * TOLD


@pytest.mark.parametrize("kind", ["white", "held", "behind a lag", "smooth", "sine"])
def test_a_plant_behind_a_test_signal_does_not(kind: str) -> None:
    assert not told_by_output(*open_loop(kind)) < 5.0 * TOLD


def test_the_output_is_not_asked_where_it_is_missing() -> None:
    u, y = regulated_loop(2)
    y[::200] = np.nan
    assert told_by_output(u, y) < TOLD
    assert np.isnan(told_by_output(u[:100], y[:100]))
    assert np.isnan(told_by_output(np.ones(COUNT), y))


def test_the_inverse_of_a_controller_is_told_from_a_plant() -> None:
    u, y = regulated_loop(3, integral=0.0)
    with pytest.warns(LogWarning, match="inverse of the controller"):
        found = identify_channels(channels_from([u], [y], 0.01, ["u"], "y"), order=1)
    model = found.model.linear
    assert model is not None
    assert model.dc_gain == pytest.approx(-0.5, abs=0.01)
    assert IdentificationCode.REGULATED in {note.code for note in found.notes}


def test_one_input_of_several_may_be_a_controllers() -> None:
    u, y = regulated_loop(4)
    other = np.random.default_rng(RNG_SEED).standard_normal(COUNT)
    with pytest.warns(LogWarning, match="tells 'heater'"):
        identify_channels(channels_from([np.column_stack([other, u])], [y], 0.01, ["other", "heater"], "y"), order=1)


@pytest.mark.parametrize("structure", ["arx", "hammerstein"])
def test_other_structures_have_the_note_too(structure: str) -> None:
    u, y = regulated_loop(5, integral=0.0)
    with pytest.warns(LogWarning, match="inverse of the controller"):
        identify_channels(
            channels_from([u], [y], 0.01, ["u"], "y"), structure=structure, order=1, delay=0, n_numerator=1
        )


def test_an_input_that_seems_late_has_the_note_too() -> None:
    u, y = regulated_loop(6, late=1)
    with pytest.warns(LogWarning):
        found = identify_channels(channels_from([u], [y], 0.01, ["u"], "y"), order=1)
    assert {IdentificationCode.INPUT_LOGGED_LATE, IdentificationCode.REGULATED} <= {one.code for one in found.notes}
    assert not found.sound


def test_a_record_has_the_note_too() -> None:
    u, y = regulated_loop(6, integral=0.0)
    with pytest.warns(LogWarning, match="inverse of the controller"):
        identify_record(Record(1e-3, {"motor_speed_rad_s": u, "velocity_m_s": y}), n_numerator=1, n_denominator=1)
