"""Presumed stiffness of the inner circuit's accumulator, and what the log of a compact actuator shows of it."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.fits.flow.accumulator import (
    FAR_STIFFER,
    LEAST_GAS,
    MOST_GAS,
    SOFT_DEVIATIONS,
    first_stiffness,
    gas_contradicted,
    is_far_stiffer,
    oil_exchange,
    presumed_stiffness,
)
from estimation.fits.flow.fit import fit_flow
from estimation.models.flow import STIFFNESS
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen

SMALL = 1.2e-4
"""Gas of a compact actuator's accumulator [m^3]: 1.7 times what its chambers take up, an eighth of the paper's."""


@cache
def compact(seed: int) -> Record:
    rng, p = np.random.default_rng(seed), CircuitParameters(accumulator_gas=SMALL, accumulator_oil=SMALL)
    return simulate(CIRCUIT, make_drive("multisine", 6.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def test_a_stated_gas_volume_sets_the_presumed_stiffness_with_its_uncertainty() -> None:
    rig = replace(PAPER, accumulator_gas=SMALL)
    known, doubted = (presumed_stiffness(rig, {"accumulator_gas": doubt})[STIFFNESS] for doubt in (0.0, 0.3))
    assert rig.accumulator_pressure / SMALL < known[0] < 1.4 * rig.accumulator_pressure / SMALL
    assert doubted[0] == known[0]
    assert known[1] < 0.1  # from the exponent alone
    assert doubted[1] == pytest.approx(math.hypot(known[1], 0.3))


def test_an_unstated_gas_volume_is_presumed_from_the_oil_that_the_accumulator_exchanges() -> None:
    value, spread = presumed_stiffness(PAPER, {})[STIFFNESS]
    gas = np.array([LEAST_GAS, MOST_GAS]) * oil_exchange(PAPER)
    assert np.abs(np.log(value * gas / PAPER.accumulator_pressure)).max() < 2.0 * spread


def test_searches_begin_at_the_soft_end_of_what_is_presumed() -> None:
    begun = first_stiffness(replace(seen(log(0.1)), presumed={STIFFNESS: (3e8, 0.4)}))
    assert begun == pytest.approx(3e8 / math.exp(0.4 * SOFT_DEVIATIONS))


def test_the_accumulator_of_a_single_rod_also_exchanges_the_volume_of_its_rod() -> None:
    single = replace(PAPER, area_difference=0.2, stroke=0.3)
    assert oil_exchange(single) - oil_exchange(PAPER) == pytest.approx(4.0 * 0.1 * single.piston_area * 0.3)


def test_an_accumulator_is_far_stiffer_than_presumed_beyond_a_limit_in_deviations() -> None:
    """In 45 plain logs it is at most 0.6 deviations stiffer; in two with an encoder homed at a stop it was 2.4."""
    plain = seen(log(0.2))
    usual, std = plain.presumed[STIFFNESS]
    for deviations, wanted in ((0.6, False), (FAR_STIFFER - 0.01, False), (FAR_STIFFER + 0.01, True), (-3.0, False)):
        assert is_far_stiffer(plain, {STIFFNESS: usual * math.exp(deviations * std)}) is wanted
    assert not is_far_stiffer(plain, {STIFFNESS: 0.0})
    assert not is_far_stiffer(plain, {"bulk_modulus": 2e8})  # a form with held volumes has no accumulator


@pytest.mark.parametrize(
    ("less", "left", "limit"),
    [(2.5, 0.1, "least"), (1.0, 0.1, None), (-2.5, 0.1, "most")],
)
def test_a_stated_gas_volume_that_the_log_contradicts_is_reported(less: float, left: float, limit: str | None) -> None:
    rig = replace(PAPER, accumulator_gas=SMALL)
    usual, spread = presumed_stiffness(rig, {"accumulator_gas": 0.35})[STIFFNESS]
    told = replace(seen(log(0.2)), presumed={STIFFNESS: (usual, spread)})
    found = usual * math.exp(-less)
    fit = replace(made_fit(100.0, 2e8, 1e6), values={STIFFNESS: found}, std={STIFFNESS: left * found})
    said = gas_contradicted(told, fit, rig)
    assert [note.data["limit"] for note in said] == ([] if limit is None else [limit])
    assert gas_contradicted(told, fit, PAPER) == ()  # this rig file states no gas volume
    assert gas_contradicted(told, replace(fit, std={STIFFNESS: np.inf}), rig) == ()  # the log does not show the gas


@pytest.mark.parametrize("stated", [None, SMALL, 2.0 * SMALL])
def test_bulk_modulus_and_gas_of_a_compact_actuator_are_right_whatever_its_rig_file_states(
    stated: float | None,
) -> None:
    """With the gas held to the paper's size, bulk modulus was 1.1 % low, by six deviations."""
    rig = replace(EhaParameters(), accumulator_gas=stated)
    fit = fit_flow(compact(3), rig, rig.bulk_modulus, {"accumulator_gas": 0.3})
    value, std = fit.parameters["bulk_modulus"]
    assert not fit.reasons
    assert fit.explanation is None
    assert abs(value - rig.bulk_modulus) < 3.0 * std
    stiffness, doubt = fit.parameters[STIFFNESS]
    assert abs(stiffness - rig.accumulator_pressure / SMALL) < 3.0 * doubt < stiffness
