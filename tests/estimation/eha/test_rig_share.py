"""The rig's share in a result: responses agree with refits, and total intervals cover if the rig file is wrong."""

import math
from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.estimate import estimate_log
from estimation.eha.rig_share import fitted_responses, scaled_responses, undetermined_delivery, with_total, with_wear
from estimation.finding import Quantity, positive_interval_95
from estimation.fits.flow.fit import fit_flow
from estimation.fits.hypothesis_search.not_excluded import open_wear_note
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain
from estimation.notes import EstimateCode, RigCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.doubts import DEFAULT_UNCERTAINTIES, PRESSURE_GAIN, Spread
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, simulate
from plant.eha.steady_state import steady_state
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
PRESSURE = "differential_pressure_pa"
ENTRIES = ("pump_displacement", "piston_area", "chamber_volume")


def log(p: EhaParameters, drive: str = "steps", seed: int = 8, duration: float = 3.0) -> Record:
    rng = np.random.default_rng(seed)
    return simulate(LUMPED, make_drive(drive, duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def changed(record: Record, entry: str, factor: float) -> tuple[Record, EhaParameters]:
    """Return a log and a rig with a larger entry; a larger assumed gain makes the pressure smaller."""
    if entry == PRESSURE_GAIN:
        return record.replace(**{PRESSURE: record[PRESSURE] / factor}), HEALTHY
    return record, replace(HEALTHY, **{entry: factor * asdict(HEALTHY)[entry]})


NUDGED = 1.001
"""Factor on an entry: the fit would detect a pump whose delivery differs by 1 %."""


@pytest.mark.parametrize("entry", [*ENTRIES, PRESSURE_GAIN])
def test_the_fits_response_to_an_entry_is_that_of_a_refit(entry: str) -> None:
    record = log(parameters_for(CONDITIONS["major_leakage"]))
    first = fit_flow(record, HEALTHY, 2e8, dict.fromkeys(ENTRIES, 0.1))
    again = fit_flow(*changed(record, entry, NUDGED), 2e8)
    for name in ("bulk_modulus", "leakage_coefficient"):
        moved = math.log(again.parameters[name][0] / first.parameters[name][0]) / math.log(NUDGED)
        assert fitted_responses(first)[name][entry] == pytest.approx(moved, rel=0.3, abs=0.15)


FILTERS = {"pressure": "with pressure", "acceleration": "without it"}


@pytest.mark.parametrize("form", FILTERS)
@pytest.mark.parametrize("entry", ["chamber_volume", PRESSURE_GAIN])
def test_a_filters_bulk_modulus_scales_with_volume_and_pressure_gain_as_predicted(form: str, entry: str) -> None:
    record, pressure = log(HEALTHY, duration=6.0), FILTERS[form] == "with pressure"
    moved = [
        estimate_bulk_modulus(seen, rig, form=form, method="ekf").value
        for seen, rig in (changed(record, entry, factor) for factor in (1.0, 1.02))
    ]
    law = scaled_responses(HEALTHY, {}, pressure=pressure)["bulk_modulus"]
    assert moved[0]
    assert moved[1]
    assert math.log(moved[1] / moved[0]) / math.log(1.02) == pytest.approx(law.get(entry, 0.0), abs=0.1)


@pytest.mark.slow
def test_without_pressure_bulk_modulus_and_leakage_scale_with_the_moving_mass() -> None:
    # 4 s allow optima 4 % apart, and with 8 s the bound may exceed 3 %, so that no number is reported
    record = log(HEALTHY, duration=10.0).replace(**{PRESSURE: None})
    heavy = replace(HEALTHY, moving_mass=1.3 * HEALTHY.moving_mass)
    found = [estimate_bulk_modulus(record, rig, form="motion") for rig in (HEALTHY, heavy)]
    values = [{"bulk_modulus": one.value or 0.0, **{name: v for name, (v, _) in one.others.items()}} for one in found]
    for name in ("bulk_modulus", "leakage_coefficient"):
        moved = math.log(values[1][name] / values[0][name]) / math.log(1.3)
        assert found[0].responses[name]["moving_mass"] == pytest.approx(moved, abs=0.15)


@pytest.mark.parametrize(("pressure", "scale"), [(True, 1.0), (False, 2.0)])
def test_displacement_and_area_that_grow_together_scale_bulk_modulus_and_leakage(pressure: bool, scale: float) -> None:
    laws = scaled_responses(HEALTHY, {}, pressure=pressure)
    oil, leakage = laws["bulk_modulus"], laws["leakage_coefficient"]
    assert oil["pump_displacement"] + oil.get("piston_area", 0.0) == -scale
    leaked = HEALTHY.leakage_coefficient * steady_state(HEALTHY.rated_speed, HEALTHY)[1]
    not_scaled = HEALTHY.flow_bias / leaked  # the flow bias is not scaled, so leakage absorbs its share
    assert leakage["pump_displacement"] + leakage["piston_area"] == pytest.approx(scale + not_scaled)


def quantity(value: float, std: float) -> Quantity:
    return Quantity.normal(value, std, "Pa")


def test_an_exact_rig_makes_the_total_interval_equal_to_the_one_given_the_rig() -> None:
    one = with_total(quantity(2e8, 1e6), {"chamber_volume": 1.0}, {})
    assert one.ci95_total == one.ci95


def test_a_proportional_response_gives_a_total_interval_even_in_the_logarithm() -> None:
    one = with_total(quantity(2e8, 0.0), {"chamber_volume": 1.0}, {"chamber_volume": Spread.of(0.15)})
    assert one.ci95_total == pytest.approx((2e8 * math.exp(-1.96 * 0.15), 2e8 * math.exp(1.96 * 0.15)), rel=1e-4)


def test_a_negative_response_swaps_the_two_sides_of_an_entrys_uncertainty() -> None:
    one = with_total(quantity(1.0, 0.0), {"moving_mass": -1.0}, {"moving_mass": Spread(0.1, 0.4)})
    assert one.ci95_total == pytest.approx((math.exp(-1.96 * 0.4), math.exp(1.96 * 0.1)), rel=1e-4)


@pytest.mark.parametrize(("std", "doubt"), [(0.04, 0.0), (0.3, 0.15), (1.5, 0.5), (200.0, 0.5)])
def test_a_positive_quantity_has_positive_intervals_even_if_it_is_vague(std: float, doubt: float) -> None:
    """The interval of a bulk modulus that its check had refused was -300 to 700 MPa."""
    one = Quantity(2e8, "Pa", positive_interval_95(2e8, std * 2e8), std * 2e8)
    one = with_total(one, {"moving_mass": 1.0}, {"moving_mass": Spread.of(doubt)} if doubt else {})
    assert one.ci95 is not None
    assert one.ci95_total is not None
    assert 0.0 < one.ci95_total[0] <= one.ci95[0] * (1.0 + 1e-12) < 2e8 < one.ci95[1] <= one.ci95_total[1] * (1 + 1e-12)
    assert math.log(one.ci95[1] / 2e8) == pytest.approx(math.log(2e8 / one.ci95[0]))
    assert math.isfinite(one.ci95_total[1])


def test_the_interval_of_a_small_difference_of_flows_ends_at_zero() -> None:
    one = with_total(quantity(5e-12, 1e-13), {"pump_displacement": 60.0}, {"pump_displacement": Spread.of(0.03)})
    assert one.ci95_total is not None
    assert one.ci95_total[0] == 0.0
    assert one.ci95_total[1] == pytest.approx(5e-12 * (1.0 + 60.0 * math.expm1(1.96 * 0.03)), rel=1e-3, abs=0.0)


def test_a_quantity_without_known_responses_has_no_total_interval() -> None:
    assert with_total(quantity(1.0, 0.1), None, {"chamber_volume": Spread.of(0.15)}).ci95_total is None


EXACT = {name: 0.0 for name in DEFAULT_UNCERTAINTIES if getattr(HEALTHY, name, 1.0) is not None}
"""Uncertainties of a rig file whose entries are all exact."""


def test_the_rigs_uncertainty_widens_only_the_total_interval_and_changes_no_outcome() -> None:
    exact, usual, vague = (
        estimate_log(log(HEALTHY), Rig(uncertainties=given)) for given in (EXACT, {}, {"chamber_volume": 2.0})
    )
    for found in (usual, vague):
        assert (found.outcome, found.gate) == (exact.outcome, exact.gate)
        for name, one in found.quantities.items():
            assert (one.value, one.std) == (exact.quantities[name].value, exact.quantities[name].std)
            assert one.ci95 == exact.quantities[name].ci95 == exact.quantities[name].ci95_total
            assert one.ci95
            assert one.ci95_total
            assert one.ci95_total[0] < one.ci95[0] < one.ci95[1] < one.ci95_total[1]


def noted(given: Mapping[str, float], measured: tuple[str, ...] = ()) -> list[tuple[str, float]]:
    found = estimate_log(log(HEALTHY), Rig(uncertainties=given, measured=measured))
    return [(n.data["entry"], n.data["percent"]) for n in found.notes if n.code == EstimateCode.KNOWN_AS_THE_RIG]


def test_a_note_names_the_rig_entry_that_limits_the_accuracy_of_bulk_modulus() -> None:
    assert noted(EXACT) == []
    ((entry, percent),) = noted({})
    assert entry == "chamber_volume"
    assert 80.0 < percent < 100.0
    ((entry, _),) = noted({"chamber_volume": 0.001, "pump_displacement": 0.1})
    assert entry == "pump_displacement"
    ((_, measured),) = noted({}, ("chamber_volume",))
    assert measured < percent


@pytest.mark.slow
def test_total_intervals_cover_if_rig_files_err_by_their_stated_uncertainty() -> None:
    logs = 30
    rng, covered, given = np.random.default_rng(5), list[bool](), list[bool]()
    for trial in range(logs):
        wrong = {
            name: math.exp(DEFAULT_UNCERTAINTIES[name].usual.up * rng.standard_normal())
            for name in (*ENTRIES, PRESSURE_GAIN)
        }
        true = replace(HEALTHY, **{name: wrong[name] * asdict(HEALTHY)[name] for name in ENTRIES})
        record = log(true, ("steps", "prbs")[trial % 2], seed=trial)
        found = estimate_log(record.replace(**{PRESSURE: wrong[PRESSURE_GAIN] * record[PRESSURE]}), Rig())
        one = found.quantities["bulk_modulus"]
        if one.ci95_total is not None:  # a rig that contradicts the log gives no number
            covered.append(one.ci95_total[0] <= true.bulk_modulus <= one.ci95_total[1])
            given.append(one.covers(true.bulk_modulus))
    assert len(covered) >= 0.8 * logs
    assert np.mean(covered) >= 0.85
    assert np.mean(given) <= 0.3


def test_wear_that_is_not_excluded_widens_displacement_downwards_only() -> None:
    known = {"pump_displacement": Spread(0.03, 0.02), "chamber_volume": Spread.of(0.15)}
    said = (RigCode.WEAR_NOT_EXCLUDED.note(percent=24.0, half_width=20.0),)
    assert with_wear(known, said) == {**known, "pump_displacement": Spread(pytest.approx(0.12), 0.02)}
    assert with_wear({}, said) == {"pump_displacement": Spread(pytest.approx(0.12), 0.0)}
    assert with_wear(known, (RigCode.WEAR_NOT_EXCLUDED.note(percent=4.0, half_width=4.0),)) == known
    assert with_wear(known, (RigCode.PUMP_WORN.note(percent=80.0, half_width=1.0),)) == known


def test_an_undetermined_delivery_has_its_likeliest_value_and_deviation() -> None:
    (noted,) = open_wear_note(PredictedGain(1.0, -0.04, 0.05))
    assert undetermined_delivery((noted,)) == (pytest.approx(-0.04), pytest.approx(0.05), -math.inf)
    assert undetermined_delivery(()) is None
