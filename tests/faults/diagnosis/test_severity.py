"""Severities in the units of a workshop."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimation.finding import Quantity
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.severity import (
    KIND_SPREAD,
    UNITS,
    healthy_severities,
    limits_of,
    severities,
    severities_at,
    with_bulk_modulus,
)
from plant.components.oil import effective_bulk_modulus
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state

RIG = EhaParameters()
ACTUATOR = actuator_of(RIG)


def severities_of(p: EhaParameters) -> dict[str, float]:
    return dict(severities_at(coordinates_of(p, ACTUATOR.rated), ACTUATOR))


def test_a_healthy_actuator_has_lost_nothing() -> None:
    found = severities_of(RIG)
    assert list(found) == list(UNITS)
    for name in ("velocity_lost", "added_friction", "pressure_rise", "entrained_air"):
        assert found[name] == pytest.approx(0.0, abs=1e-6)
    assert found["leakage_flow"] == pytest.approx(6e4 * (4.784e-12 * 3.4475e6 + 2.413e-6))
    assert found["bulk_modulus"] == pytest.approx(2.07e8)


@pytest.mark.parametrize("name", CONDITIONS)
def test_velocity_lost_and_pressure_rise_follow_from_the_steady_state(name: str) -> None:
    found = severities_of(parameters_for(CONDITIONS[name]))
    (velocity, pressure), (sound, low) = (
        steady_state(RIG.rated_speed, p) for p in (parameters_for(CONDITIONS[name]), RIG)
    )
    assert found["velocity_lost"] == pytest.approx(100.0 * (1.0 - velocity / sound), abs=1e-6)
    assert found["pressure_rise"] == pytest.approx(100.0 * (pressure / low - 1.0), abs=1e-6)


def test_entrained_air_is_the_share_that_explains_a_soft_oil() -> None:
    share = 0.01
    soft = float(effective_bulk_modulus(RIG.accumulator_pressure, RIG.bulk_modulus, share, 0.0))
    assert severities_of(replace(RIG, bulk_modulus=soft))["entrained_air"] == pytest.approx(100.0 * share, rel=0.05)


def test_severities_rise_with_their_fault() -> None:
    leaking = [
        severities_of(parameters_for(CONDITIONS[n]))["leakage_flow"]
        for n in ("normal", "minor_leakage", "major_leakage")
    ]
    rubbing = [
        severities_of(parameters_for(CONDITIONS[n]))["added_friction"]
        for n in ("normal", "minor_friction", "major_friction")
    ]
    assert np.all(np.diff(leaking) > 1.0)
    assert np.all(np.diff(rubbing) > 1000.0)


def fits(spread: np.ndarray, place: int = 0) -> ClassFits:
    """Return a circuit at the centre of a condition, with a given covariance."""
    empty = np.zeros((10, 2))
    best = PointFit(ACTUATOR.conditions[place], 0.0, np.eye(7), np.ones(2), empty, np.zeros((7, 10, 2)))
    nine = np.zeros(len(CONDITIONS))
    return ClassFits(best, np.linalg.inv(spread), nine, np.zeros((9, 2)), nine, lambda: spread, 1.0)


NARROW = np.diag(np.full(7, 0.01**2))


def extent(one: Quantity) -> float:
    assert one.ci95 is not None
    return one.ci95[1] - one.ci95[0]


def ratio(one: Quantity) -> float:
    assert one.ci95 is not None
    return math.log(one.ci95[1] / one.ci95[0])


def test_a_bent_friction_law_widens_the_total_intervals_of_friction_and_pressure_rise() -> None:
    moved = np.zeros((7, 1))
    moved[COORDINATES.index("friction_rated")] = 0.3
    straight, bent = (severities(one, ACTUATOR) for one in (fits(NARROW), replace(fits(NARROW), bend_shifts=moved)))
    for name in ("added_friction", "pressure_rise"):
        low, high = bent[name].ci95_total or (0.0, 0.0)
        assert bent[name].ci95 == straight[name].ci95
        assert high - low > 3.0 * extent(bent[name])
    assert bent["leakage_flow"] == straight["leakage_flow"]


def test_the_width_of_an_interval_follows_from_covariance_and_slopes_of_either_sign() -> None:
    tight, step = np.diag(np.full(7, 1e-4**2)), 1e-5
    for place in range(len(CONDITIONS)):
        centre, found = ACTUATOR.conditions[place], severities(fits(tight, place), ACTUATOR)
        sides = [[severities_at(centre + way * step * one, ACTUATOR) for one in np.eye(7)] for way in (1.0, -1.0)]
        for name in ("leakage_flow", "velocity_lost", "added_friction", "pressure_rise", "bulk_modulus"):
            slope = np.array([up[name] - down[name] for up, down in zip(*sides, strict=True)]) / (2.0 * step)
            expected = 2.0 * 1.96 * 1e-4 * float(np.linalg.norm(slope))
            assert extent(found[name]) == pytest.approx(expected, rel=0.06), (place, name)


def test_a_calibration_width_scales_only_its_own_interval() -> None:
    plain = severities(fits(NARROW), ACTUATOR)
    for name in ("leakage_flow", "velocity_lost", "added_friction", "pressure_rise", "bulk_modulus"):
        wide = severities(fits(NARROW), ACTUATOR, {name: 2.5})
        for other, one in plain.items():
            if other != "entrained_air":
                size = ratio if other == "bulk_modulus" else extent
                assert size(wide[other]) == pytest.approx((2.5 if other == name else 1.0) * size(one)), (name, other)
    loose = severities(fits(np.diag(np.full(7, 0.3**2))), ACTUATOR, {"bulk_modulus": 4.0})["bulk_modulus"]
    assert loose.ci95 is not None
    assert 0.0 < loose.ci95[0] < 1e8  # the lower end was negative


def test_an_interval_covers_95_percent_of_the_posterior() -> None:
    found = severities(fits(NARROW), ACTUATOR)["bulk_modulus"]
    assert found.ci95 is not None
    assert extent(found) == pytest.approx(2.0 * 1.96 * 0.01 * 2.07e8, rel=0.15)
    assert found.ci95[0] < found.value < found.ci95[1]  # type: ignore[operator]


def test_twice_the_deviation_gives_twice_the_interval() -> None:
    once, twice = (severities(fits(factor * NARROW), ACTUATOR) for factor in (1.0, 4.0))
    for name in ("leakage_flow", "added_friction", "bulk_modulus"):
        assert extent(twice[name]) == pytest.approx(2.0 * extent(once[name]), rel=0.1)


def soft(share: float, width: float) -> Quantity:
    value = share * RIG.bulk_modulus
    ends = value * (1.0 - width), value * (1.0 + width)
    return Quantity(value, "Pa", ends, ci95_total=(0.9 * ends[0], 1.1 * ends[1]))


def test_air_is_certain_only_in_oil_softer_than_any_sound_oil_of_its_kind() -> None:
    plain = severities(fits(NARROW), ACTUATOR)
    sure, unsure = (with_bulk_modulus(plain, soft(share, 0.02), ACTUATOR) for share in (0.5, 0.95 - KIND_SPREAD + 0.08))
    assert sure["bulk_modulus"].value == 0.5 * RIG.bulk_modulus
    assert sure["entrained_air"].ci95 is not None
    assert sure["entrained_air"].ci95[0] > 0.0
    assert unsure["entrained_air"].value is not None
    assert unsure["entrained_air"].value > 0.0
    assert unsure["entrained_air"].ci95 is not None
    assert unsure["entrained_air"].ci95[0] == 0.0


def test_a_softer_oil_holds_more_air_with_a_total_interval_around_its_interval() -> None:
    plain = severities(fits(NARROW), ACTUATOR)
    less, more = (with_bulk_modulus(plain, soft(share, 0.02), ACTUATOR)["entrained_air"] for share in (0.6, 0.4))
    assert less.value is not None
    assert more.value is not None
    assert more.value > 1.5 * less.value > 0.0
    assert more.ci95 is not None
    assert more.ci95_total is not None
    assert more.ci95_total[0] < more.ci95[0] < more.value < more.ci95[1] < more.ci95_total[1]


def test_without_an_estimate_of_bulk_modulus_air_has_no_number() -> None:
    found = with_bulk_modulus(severities(fits(NARROW), ACTUATOR), Quantity(None, "Pa"), ACTUATOR)
    assert found["bulk_modulus"].value is None
    assert found["entrained_air"].value is None


def test_a_circuit_without_a_steady_state_has_no_number_and_no_interval() -> None:
    nowhere = replace(fits(NARROW).best, coordinates=np.full(7, np.nan))
    found = severities(replace(fits(NARROW), best=nowhere), ACTUATOR)
    assert found["leakage_flow"].value is None
    assert found["leakage_flow"].ci95 is None


def test_a_limit_is_halfway_between_a_healthy_actuator_and_a_minor_fault() -> None:
    limits, healthy = limits_of(ACTUATOR), severities_of(RIG)
    leaking, rubbing = (severities_of(parameters_for(CONDITIONS[name])) for name in ("minor_leakage", "minor_friction"))
    for name, faulty in (
        ("leakage_flow", leaking),
        ("velocity_lost", leaking),
        ("added_friction", rubbing),
        ("pressure_rise", rubbing),
    ):
        assert limits[name] - healthy[name] == pytest.approx(faulty[name] - limits[name], rel=1e-9), name
    assert limits["bulk_modulus"] == pytest.approx(0.8 * RIG.bulk_modulus)


def test_healthy_severities_and_limits_of_an_actuator_are_cached() -> None:
    sound = healthy_severities(ACTUATOR)
    assert sound == severities_at(ACTUATOR.conditions[0], ACTUATOR)
    assert healthy_severities(ACTUATOR) is sound
    assert limits_of(ACTUATOR) is limits_of(ACTUATOR)
    worn = actuator_of(replace(RIG, leakage_coefficient=9e-12))
    assert limits_of(worn) != limits_of(ACTUATOR)
