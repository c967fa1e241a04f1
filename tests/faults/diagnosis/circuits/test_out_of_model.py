"""A log that no condition explains is "unknown"; each reason has its own limit, and applies above it only."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.rig_share import SOFT_OIL_RATIO
from faults.conditions import CONDITIONS, severity
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import PointFit, scales_of
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.out_of_model import (
    AVERAGING_TIME,
    LEAST_BIAS,
    SEAL_YIELD,
    reasons_against,
    unexplained_notes,
)
from faults.diagnosis.circuits.region_scores import region_scores
from faults.diagnosis.circuits.yielding import UNEXPLAINED, YIELDING_SHARE
from faults.notes import AgainstCode
from plant.eha.model import EhaParameters
from plant.notes import Note

RIG = EhaParameters()
ACTUATOR = actuator_of(RIG)
INFORMATION = 1e4 * np.eye(len(COORDINATES))
LEVELS = [60.0, 120.0, 90.0, 120.0, -120.0, -70.0, -120.0, -100.0]
NOISE = np.array([1e-4, 2e3])


@cache
def run_of(place: tuple[float, ...], dwell: int = 1000, pump: float = 1.0) -> Blocks:
    """Return the log of a circuit at eight speeds, each held for ``dwell`` milliseconds, without noise.

    Its pump delivers ``pump`` times as much as the rig's.
    """
    speed = np.repeat(LEVELS, dwell)
    empty = np.zeros(len(speed) // 10)
    blank = Blocks(np.append(speed, speed[-1]), 1e-3, 10, empty, empty, NOISE)
    circuit = replace(ACTUATOR.circuit, pump_displacement=pump * ACTUATOR.circuit.pump_displacement)
    (found,) = predicted_outputs(blank, parameter_rows(np.array([place]), circuit, ACTUATOR.rated))
    return replace(blank, velocity=found[:, 0], pressure=found[:, 1])


@cache
def slopes_of(place: tuple[float, ...]) -> np.ndarray:
    """Return the derivatives of a circuit's outputs with respect to its coordinates."""
    point = np.array(place)
    rows = parameter_rows(np.vstack([point, point + 0.02 * np.eye(len(point))]), ACTUATOR.circuit, ACTUATOR.rated)
    runs = predicted_outputs(run_of(place), rows)
    return (runs[1:] - runs[0]) / 0.02


def fitted(blocks: Blocks, place: np.ndarray) -> ClassFits:
    """Return fits whose best circuit has given coordinates."""
    key = tuple(place.tolist())
    scales, slopes = scales_of(blocks, run_of(key).outputs), slopes_of(key)
    weighted = (slopes[:, blocks.first :] / scales).reshape(len(place), -1)
    best = PointFit(place, 0.0, weighted @ weighted.T, scales, run_of(key).outputs, slopes)
    nine = np.zeros(len(CONDITIONS))
    return ClassFits(
        best, INFORMATION, nine, np.zeros((len(CONDITIONS), 2)), nine, lambda: np.linalg.inv(INFORMATION), 1.0
    )


def reasons(blocks: Blocks, place: np.ndarray | None = None) -> Mapping[AgainstCode, Note]:
    """Return the reasons against a log, by code, for a best circuit with given coordinates; by default it is fitted."""
    fits = fit_classes(blocks, ACTUATOR) if place is None else fitted(blocks, place)
    region = float(np.max(region_scores(fits.best, fits.information, ACTUATOR)))
    return {AgainstCode(note.code): note for note in reasons_against(blocks, fits, region, ACTUATOR)}


def shifted(**by: float) -> np.ndarray:
    """Return the healthy circuit's coordinates, some of them shifted, in logarithms."""
    return ACTUATOR.conditions[0] + np.array([by.get(name, 0.0) for name in COORDINATES])


def at(leakage: float, friction: float) -> np.ndarray:
    """Return the coordinates of a circuit with these severities."""
    return coordinates_of(severity(leakage, friction, ACTUATOR.circuit), ACTUATOR.rated)


def healthy() -> Blocks:
    return run_of(tuple(ACTUATOR.conditions[0].tolist()))


@pytest.mark.parametrize("place", range(len(CONDITIONS)), ids=list(CONDITIONS))
def test_the_log_of_a_nominal_circuit_has_no_objection(place: int) -> None:
    point = ACTUATOR.conditions[place]
    assert not reasons(run_of(tuple(point.tolist())), point)


def test_a_pressure_of_0_throughout_is_wholly_unexplained_without_a_numpy_warning() -> None:
    log = healthy()
    dead = replace(log, pressure=np.zeros(len(log.velocity)))
    with warnings.catch_warnings(action="error"):
        (said,) = unexplained_notes(dead, fitted(dead, ACTUATOR.conditions[0]), ACTUATOR)
    assert (said.data["channel"], said.data["percent"]) == ("differential pressure", np.inf)


@pytest.mark.parametrize(("channel", "name"), [(0, "velocity"), (1, "differential pressure")])
def test_a_log_is_unexplained_once_its_circuit_leaves_more_than_the_stated_share(channel: int, name: str) -> None:
    log = healthy()
    alternating = np.where(np.arange(len(log.velocity)) % 100 < 50, 1.0, -1.0)
    size = float(np.sqrt(np.mean(log.outputs[log.first :, channel] ** 2)))

    def with_left(share: float) -> Blocks:
        changed = log.outputs + share * size * np.outer(alternating, np.eye(2)[channel])
        return replace(log, velocity=changed[:, 0], pressure=changed[:, 1])

    place, limit = ACTUATOR.conditions[0], UNEXPLAINED[channel]
    assert AgainstCode.UNEXPLAINED not in reasons(with_left(0.9 * limit), place)
    said = reasons(with_left(1.2 * limit), place)[AgainstCode.UNEXPLAINED]
    assert said.data["channel"] == name
    assert said.data["percent"] == pytest.approx(120.0 * limit, rel=0.02)
    assert 0.02 < limit < 0.25


def test_residuals_within_sensor_noise_are_not_an_objection() -> None:
    log = replace(healthy(), noise=np.array([1.0, 1e9]))
    noisy = replace(log, velocity=log.velocity * np.where(np.arange(len(log.velocity)) % 2, 1.3, 0.7))
    assert AgainstCode.UNEXPLAINED not in reasons(noisy, ACTUATOR.conditions[0])


@pytest.mark.parametrize(("share", "code"), [(0.4, AgainstCode.OIL_SOFT), (2.5, AgainstCode.OIL_STIFF)])
def test_an_oil_less_than_half_or_more_than_twice_as_stiff_is_an_objection(share: float, code: AgainstCode) -> None:
    point = shifted(bulk_modulus=float(np.log(share)))
    said = reasons(run_of(tuple(point.tolist())), point)
    assert list(said) == [code]
    assert said[code].data["share"] == pytest.approx(share)
    near = shifted(bulk_modulus=float(np.log(0.75 if share < 1.0 else 1.3)))
    assert not {AgainstCode.OIL_SOFT, AgainstCode.OIL_STIFF} & set(reasons(run_of(tuple(near.tolist())), near))
    assert 0.4 < SOFT_OIL_RATIO < 0.75


@pytest.mark.parametrize(("known", "said"), [(0.01, True), (0.3, False)])
def test_an_oil_is_named_soft_only_if_the_log_determines_its_bulk_modulus(known: float, *, said: bool) -> None:
    point = shifted(bulk_modulus=float(np.log(0.45)))
    log = run_of(tuple(point.tolist()))
    fits = replace(fitted(log, point), information=np.diag([1e4, 1e4, 1e4, 1e4, 1e4, known**-2, 1e4]))
    found = reasons_against(log, fits, 0.0, ACTUATOR)
    assert (AgainstCode.OIL_SOFT in [note.code for note in found]) == said


def slipping(late: int, far: float = 1.0, *, pressure: bool = True) -> bool:
    """Return whether velocity is unexplained if the circuit slips ``late`` blocks earlier, ``far`` times as far."""
    log, place = healthy(), ACTUATOR.conditions[0]
    slips = 0.02 * (np.arange(len(log.velocity)) % 40 < 3)
    seen = replace(log, velocity=np.roll(slips, late), pressure=log.pressure if pressure else None)
    seen = seen if pressure else replace(seen, noise=NOISE[:1])
    whole = fitted(log, place)
    run = np.nan_to_num(log.outputs)[:, : len(seen.noise)]
    run[:, 0] = far * slips
    best = replace(
        whole.best, fitted=run, slopes=whole.best.slopes[..., : len(seen.noise)], scales=scales_of(seen, run)
    )
    found = reasons_against(seen, replace(whole, best=best), 0.0, ACTUATOR)
    return any(note.code is AgainstCode.UNEXPLAINED and note.data["channel"] == "velocity" for note in found)


def test_a_slip_some_blocks_early_is_explained_if_its_travel_and_pressure_are_followed() -> None:
    assert not slipping(2)
    assert slipping(2, pressure=False)
    assert slipping(2, far=1.5)
    assert slipping(20)


def jumping(jump: float, *, pressure_left: float = 0.0, drift: float = 0.0, pressure: bool = True) -> bool:
    """Return whether velocity is unexplained if the circuit creeps while the log jumps ``jump`` [m] every 40 ms."""
    log, whole = healthy(), fitted(healthy(), ACTUATOR.conditions[0])
    velocity = jump / 0.01 * (np.arange(len(log.velocity)) % 4 == 1)
    seen = replace(log, velocity=velocity, pressure=log.pressure if pressure else None)
    seen = seen if pressure else replace(seen, noise=NOISE[:1])
    run = np.nan_to_num(seen.outputs).copy()
    run[:, 0] = jump / 0.04 + drift
    run[:, 1:] *= 1.0 + pressure_left
    slopes = whole.best.slopes[..., : len(seen.noise)]
    best = replace(whole.best, fitted=run, slopes=slopes, scales=scales_of(seen, run))
    found = reasons_against(seen, replace(whole, best=best), 0.0, ACTUATOR)
    return any(note.code is AgainstCode.UNEXPLAINED and note.data["channel"] == "velocity" for note in found)


def test_stick_slip_at_other_times_is_explained_if_its_travel_and_pressure_are_followed() -> None:
    yielded = SEAL_YIELD * ACTUATOR.circuit.presliding_displacement
    assert yielded == pytest.approx(54e-6, rel=0.01)
    assert not jumping(1e-4)
    assert jumping(3e-4)
    assert jumping(1e-4, pressure_left=1.2 * UNEXPLAINED[1])
    assert jumping(1e-4, drift=1.1 * yielded / AVERAGING_TIME)
    assert jumping(1e-4, pressure=False)


def test_without_pressure_a_log_whose_motion_no_circuit_follows_is_unexplained() -> None:
    place = ACTUATOR.conditions[0]
    log, pump = healthy(), ACTUATOR.circuit.pump_displacement / ACTUATOR.circuit.piston_area
    left = 0.5 * YIELDING_SHARE * pump * float(np.sqrt(np.mean(log.speed**2)))
    velocity = left * np.where(np.arange(len(log.velocity)) % 20 < 10, 1.0, -1.0)
    alone = replace(log, velocity=velocity, pressure=None, noise=NOISE[:1])
    whole = fitted(log, place)
    best = replace(whole.best, fitted=np.zeros((len(velocity), 1)), slopes=whole.best.slopes[..., :1])
    best = replace(best, scales=scales_of(alone, best.fitted))
    found = reasons_against(alone, replace(whole, best=best), 0.0, ACTUATOR)
    assert AgainstCode.UNEXPLAINED in [note.code for note in found]
    assert fit_classes(alone, ACTUATOR).lasting == 1.0
    assert fit_classes(replace(log, velocity=log.velocity + velocity), ACTUATOR).lasting > 2.0


def test_a_circuit_halfway_between_two_leakage_levels_is_between_conditions() -> None:
    point = at(0.5, 0.0)
    said = reasons(run_of(tuple(point.tolist())), point)
    assert list(said) == [AgainstCode.BETWEEN_CONDITIONS]
    assert said[AgainstCode.BETWEEN_CONDITIONS].data == {"leakage": 0.5, "friction": 0.0}


def test_a_circuit_far_beyond_every_condition_is_outside_conditions() -> None:
    point = shifted(leakage=5.0, friction_rated=2.0)
    found = reasons(run_of(tuple(point.tolist())), point)
    assert AgainstCode.OUTSIDE_CONDITIONS in found
    assert AgainstCode.BETWEEN_CONDITIONS not in found


def test_an_actuator_with_typical_deviations_stays_in_its_condition() -> None:
    point = shifted(leakage=0.15, friction_rest=-0.1, bulk_modulus=0.1)
    assert not reasons(run_of(tuple(point.tolist())), point)


@pytest.mark.parametrize("share", [1.5, 3.0, -3.0])
def test_a_pressure_sensor_biased_beyond_its_limit_is_named_with_its_bias(share: float) -> None:
    log = healthy()
    assert log.pressure is not None
    limit = LEAST_BIAS["differential_pressure_pa"] * float(np.sqrt(np.mean(log.pressure**2)))
    found = reasons(replace(log, pressure=log.pressure + share * limit))
    assert found[AgainstCode.PRESSURE_BIAS].data["bias_pa"] == pytest.approx(share * limit, rel=0.02)
    assert not reasons(replace(log, pressure=log.pressure + np.sign(share) * 0.5 * limit))


def test_a_bias_within_two_standard_errors_is_not_an_objection() -> None:
    short, long = (run_of(tuple(ACTUATOR.conditions[0].tolist()), dwell) for dwell in (100, 1000))
    for log, said in ((short, False), (long, True)):
        assert log.pressure is not None
        limit = LEAST_BIAS["differential_pressure_pa"] * float(np.sqrt(np.mean(log.pressure**2)))
        found = reasons(replace(log, pressure=log.pressure + 1.5 * limit))
        assert (AgainstCode.PRESSURE_BIAS in found) == said


@pytest.mark.parametrize("share", [1.5, 2.5, -2.5])
def test_a_speed_sensor_biased_beyond_its_limit_is_named_with_its_bias(share: float) -> None:
    log = healthy()
    limit = LEAST_BIAS["motor_speed_rad_s"] * float(np.sqrt(np.mean(log.speed**2)))
    found = reasons(replace(log, speed=log.speed + share * limit))
    assert found[AgainstCode.SPEED_BIAS].data["bias_rad_s"] == pytest.approx(share * limit, rel=0.1)
    assert not reasons(replace(log, speed=log.speed + np.sign(share) * 0.5 * limit))


def test_a_pump_that_delivers_more_than_the_rig_file_states_is_named() -> None:
    """In a circuit, a pump that moves less looks like leakage: the flow balance judges it (decisions 220 and 238)."""
    place = tuple(ACTUATOR.conditions[0].tolist())
    found = reasons(run_of(place, pump=1.2))
    assert found[AgainstCode.PUMP_OFF].data["percent"] == pytest.approx(20.0, rel=0.35)
    for near in (0.97, 1.03):
        assert AgainstCode.PUMP_OFF not in reasons(run_of(place, pump=near))


def test_without_pressure_a_pump_that_delivers_less_is_not_an_objection_of_the_circuit() -> None:
    place = tuple(ACTUATOR.conditions[0].tolist())
    for gain, said in ((1.2, True), (0.8, False)):
        log = replace(run_of(place, pump=gain), pressure=None, noise=NOISE[:1])
        assert (AgainstCode.PUMP_OFF in reasons(log)) == said


def test_a_motor_that_never_turned_shows_no_bias_of_speed_or_pump() -> None:
    log = replace(healthy(), speed=np.zeros_like(healthy().speed))
    assert not {AgainstCode.SPEED_BIAS, AgainstCode.PUMP_OFF} & set(reasons(log, ACTUATOR.conditions[0]))
