"""The dependence of severities on the rig file: scaling laws, tested by another diagnosis with a different rig."""

from dataclasses import asdict, replace
from functools import cache
from itertools import product

import numpy as np
import pytest

from estimation.finding import Quantity
from estimation.log_checks.clean import clean_log
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.severity import with_bulk_modulus
from faults.diagnosis.severity_total import TURBULENT, with_totals
from plant.eha.doubts import PRESSURE_GAIN, Spread
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
PRESSURE = "differential_pressure_pa"
STEP = 0.02
ASKED = ("leakage_flow", "velocity_lost", "added_friction", "pressure_rise")


@cache
def log() -> Record:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive("steps", 5.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def severities_of(entry: str = "", factor: float = 1.0) -> dict[str, Quantity]:
    """Return the severities for a rig with one entry larger by a factor."""
    record, rig = log(), HEALTHY
    if entry == PRESSURE_GAIN:
        record = record.replace(**{PRESSURE: record[PRESSURE] / factor})
    elif entry:
        rig = replace(rig, **{entry: factor * asdict(rig)[entry]})
    return dict(diagnose_clean(clean_log(record, rig), actuator_of(rig)).severity)


def added_by(entry: str) -> dict[str, float]:
    """Return the shift of each severity by the laws, for an entry with an error of 2 %."""
    found = {name: one.value for name, one in severities_of().items() if one.value is not None}
    bare = {name: Quantity(value, "1", (value, value)) for name, value in found.items()}
    spread = {entry: Spread.of(float(np.log1p(STEP)) / 1.96)}
    moved = with_totals(bare, actuator_of(HEALTHY), spread, pressure=True)
    return {name: (moved[name].ci95_total or (0.0, 0.0))[1] - found[name] for name in ASKED}


@pytest.mark.parametrize("entry", ["pump_displacement", "piston_area", PRESSURE_GAIN])
def test_scaling_laws_cover_the_change_of_severities_with_another_rig(entry: str) -> None:
    first, again, law = severities_of(), severities_of(entry, 1.0 + STEP), added_by(entry)
    for name in ASKED:
        moved = abs((again[name].value or 0.0) - (first[name].value or 0.0))
        size = max(abs(first[name].value or 0.0), 1.0)
        assert moved < 1.5 * law[name] + 0.01 * size, name


def test_leakage_and_velocity_lost_change_with_displacement_by_the_scaling_laws() -> None:
    first, again, law = severities_of(), severities_of("pump_displacement", 1.0 + STEP), added_by("pump_displacement")
    for name in ("leakage_flow", "velocity_lost"):
        moved = (again[name].value or 0.0) - (first[name].value or 0.0)
        assert moved == pytest.approx(law[name], rel=0.4)


@pytest.mark.parametrize("entry", ["pump_displacement", "piston_area"])
@pytest.mark.parametrize("lost", [5.0, 28.0, 60.0])
def test_leakage_changes_with_an_entry_like_pump_flow_less_swept_flow(lost: float, entry: str) -> None:
    actuator, doubt = actuator_of(HEALTHY), 1e-3
    pumped = HEALTHY.pump_displacement * HEALTHY.rated_speed
    swept = HEALTHY.piston_area * actuator.rated * (1.0 - lost / 100.0)
    changed = pumped * (1.0 + doubt) - swept if entry == "pump_displacement" else pumped - swept * (1.0 + doubt)
    exact = {"velocity_lost": lost, "leakage_flow": 5.0, "added_friction": 20.0, "pressure_rise": 3.0}
    found = {name: Quantity(value, "1", (value, value)) for name, value in exact.items()}
    for pressure in (True, False):
        total = with_totals(found, actuator, {entry: Spread.of(doubt)}, pressure=pressure)["leakage_flow"].ci95_total
        assert total is not None
        assert (total[1] - total[0]) / 2.0 == pytest.approx(
            1.96 * 5.0 * abs(changed / (pumped - swept) - 1.0), rel=0.02
        )


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        ("leakage_flow", PRESSURE_GAIN),
        *product(
            ("velocity_lost", "added_friction", "pressure_rise"), ("pump_displacement", "piston_area", PRESSURE_GAIN)
        ),
    ],
)
def test_with_pressure_total_intervals_scale_with_displacement_area_and_pressure_gain(name: str, entry: str) -> None:
    actuator, doubt = actuator_of(HEALTHY), 1e-3
    exact = {"velocity_lost": 20.0, "leakage_flow": 5.0, "added_friction": 30.0, "pressure_rise": 4.0}
    p, v = HEALTHY, actuator.rated
    sound = p.friction_quadratic * v**2 + p.friction_linear * v + p.friction_coulomb
    gauge = sound + exact["added_friction"] if name == "added_friction" else 100.0 + exact["pressure_rise"]
    wanted = {
        "leakage_flow": {PRESSURE_GAIN: exact["leakage_flow"]},
        "velocity_lost": {"pump_displacement": 80.0, "piston_area": 80.0, PRESSURE_GAIN: 0.0},
    }.get(name, dict.fromkeys(("pump_displacement", "piston_area", PRESSURE_GAIN), gauge))
    found = {one: Quantity(value, "1", (value, value)) for one, value in exact.items()}
    total = with_totals(found, actuator, {entry: Spread.of(doubt)}, pressure=True)[name].ci95_total
    assert total is not None
    assert (total[1] - total[0]) / 2.0 == pytest.approx(1.96 * doubt * wanted[entry], rel=0.02, abs=1e-9)


def test_every_severity_of_a_diagnosis_has_a_total_interval_around_its_interval() -> None:
    found = diagnose_log(log(), Rig())
    for name, one in found.severities.items():
        assert one.ci95 is not None, name
        assert one.ci95_total is not None, name
        assert one.ci95_total[0] <= one.ci95[0] <= one.ci95[1] <= one.ci95_total[1], name
    assert found.severities["bulk_modulus"] == found.quantities["bulk_modulus"]
    assert found.condition == "minor_leakage"
    assert not found.unknown


def test_the_total_interval_of_air_follows_that_of_bulk_modulus() -> None:
    estimated = Quantity(1.5e8, "Pa", (1.49e8, 1.51e8), 5e5, (1.1e8, 2.05e8))
    air = with_bulk_modulus({}, estimated, actuator_of(HEALTHY))["entrained_air"]
    assert air.ci95 is not None
    assert air.ci95_total is not None
    assert air.ci95[0] > 0.0
    assert air.ci95_total[0] == 0.0
    assert air.ci95_total[1] > 2.0 * air.ci95[1]


def test_undetermined_severities_have_no_total_intervals() -> None:
    none = {name: Quantity(None, "1") for name in ASKED}
    assert with_totals(none, actuator_of(HEALTHY), Rig().spreads, pressure=True) == none


def test_without_pressure_the_gain_of_its_sensor_widens_no_interval() -> None:
    found = {name: replace(one, ci95_total=None) for name, one in severities_of().items()}
    doubted = {PRESSURE_GAIN: Spread.of(0.1)}
    seen, unseen = (with_totals(found, actuator_of(HEALTHY), doubted, pressure=logged) for logged in (True, False))
    for name in ("leakage_flow", "added_friction", "pressure_rise"):
        assert unseen[name].ci95_total == unseen[name].ci95
        assert seen[name].ci95_total != seen[name].ci95


@pytest.mark.parametrize("reached", [4e5, 2e6])
def test_lower_logged_pressures_extend_the_total_interval_of_leakage_downward(reached: float) -> None:
    found = {name: Quantity(5.0, "1", (4.5, 5.5)) for name in ASKED}
    actuator, share = actuator_of(HEALTHY), 1.0 - float(np.exp(-1.96 * TURBULENT.down))
    near, far = (with_totals(found, actuator, {}, pressure=True, reached=one) for one in (1e9, reached))
    less = share * (1.0 - (reached / HEALTHY.relief_pressure) ** 0.5)
    assert far["leakage_flow"].ci95_total == pytest.approx((5.0 - np.hypot(0.5, 5.0 * less), 5.5), rel=1e-4)
    assert {**far, "leakage_flow": near["leakage_flow"]} == near
    assert near["leakage_flow"].ci95_total == (4.5, 5.5)
