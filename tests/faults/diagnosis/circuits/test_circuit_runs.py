"""Circuits from coordinates, run under a log in blocks."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits import circuit_runs
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import BLOCK, Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import (
    COLUMN,
    SOFTEST_END,
    _with_stops,
    coordinates_of,
    parameter_rows,
    predicted_outputs,
)
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.eha.steady_state import steady_state
from plant.errors import LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

ACTUATOR = actuator_of(EhaParameters())
CENTRE = ACTUATOR.conditions[0]
SPEED = 100.0 * np.sign(np.sin(np.arange(3000) * 2e-3))


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_condition_is_recovered_from_its_coordinates(name: str) -> None:
    true = circuit_of(parameters_for(CONDITIONS[name]))
    (row,) = parameter_rows(coordinates_of(true, ACTUATOR.rated)[None], ACTUATOR.circuit, ACTUATOR.rated)
    found = dict(zip(CircuitParameters.__dataclass_fields__, row.tolist(), strict=True))
    for field in CircuitParameters.__dataclass_fields__:
        # the logged speed already includes the motor's lag, and no stop is known
        if field not in ("motor_lag", "stroke"):
            assert found[field] == pytest.approx(getattr(true, field), rel=1e-9, abs=0.0), field


def test_friction_opposes_motion_at_every_coordinate() -> None:
    points = np.random.default_rng(1).normal(ACTUATOR.conditions[3], 0.7, (200, 7))
    rows = parameter_rows(points, ACTUATOR.circuit, ACTUATOR.rated)
    names = list(CircuitParameters.__dataclass_fields__)
    a1, a2, a3 = (rows[:, names.index(f"friction_{part}")] for part in ("quadratic", "linear", "coulomb"))
    assert np.all(np.minimum(a2, 0.0) ** 2 < 4.0 * a1 * a3)


@pytest.mark.parametrize(("beyond", "shown"), [(-0.025, False), (-0.015, True), (0.015, True), (0.025, False)])
def test_a_piston_that_reversed_within_two_percent_of_a_stop_is_assumed_to_have_met_it(
    beyond: float, shown: bool
) -> None:
    still = np.zeros(20)
    still[5] = 0.03 * (1.0 + beyond) / 0.01  # out to a place near the stop 30 mm away
    log = Blocks(np.zeros(201), 1e-3, 10, still, None, np.ones(1))
    (row,) = _with_stops(log, parameter_rows(CENTRE[None], replace(ACTUATOR.circuit, stroke=0.06), ACTUATOR.rated))
    assert bool(row[COLUMN["stroke"]] == pytest.approx(0.06)) is shown
    assert row[COLUMN["stroke"]] > 0.059


@pytest.mark.parametrize(("stiffness", "read"), [(2e7, 2e7), (1e9, 1e8), (1e5, SOFTEST_END * 1e8)])
def test_the_stiffness_of_an_end_stop_is_read_from_pressure_and_travel_within_limits(
    stiffness: float, read: float
) -> None:
    """Ends that yielded 0.6 instead of 0.1 mm left 10 % of a small strut's pressure, and its log was unexplained."""
    healthy, moved, pressure = replace(ACTUATOR.circuit, stroke=0.06), np.zeros(20), np.zeros(20)
    moved[5], pressure[5:] = 0.0302 / 0.01, 0.0002 * stiffness / healthy.piston_area  # 0.2 mm past the stop
    log = Blocks(np.zeros(201), 1e-3, 10, moved, pressure, np.ones(2))
    (row,) = _with_stops(log, parameter_rows(CENTRE[None], healthy, ACTUATOR.rated))
    assert row[COLUMN["end_stop_stiffness"]] == pytest.approx(read)
    (blind,) = _with_stops(replace(log, pressure=None), parameter_rows(CENTRE[None], healthy, ACTUATOR.rated))
    assert blind[COLUMN["end_stop_stiffness"]] == healthy.end_stop_stiffness


@pytest.mark.parametrize("sample_time", [1e-4, 1e-3, 2e-3])
def test_blocks_are_the_same_whatever_the_sample_rate(sample_time: float) -> None:
    time = sample_time * np.arange(round(3.0 / sample_time))
    log = Record(sample_time, {"motor_speed_rad_s": np.cos(time), "position_m": 1e-2 * np.sin(time)})
    blocks = blocks_of(log)
    centres = BLOCK * (np.arange(len(blocks.velocity)) + 0.5)
    assert blocks.block * blocks.sample_time == pytest.approx(BLOCK)
    assert blocks.velocity == pytest.approx(1e-2 * np.cos(centres), abs=1e-5)
    assert blocks.travel == pytest.approx(1e-2 * np.ptp(np.sin(centres)), rel=0.02)


def test_velocity_replaces_a_missing_position_and_one_of_them_is_required() -> None:
    velocity = 0.01 * np.sin(np.arange(3000) * 1e-3)
    log = Record(1e-3, {"motor_speed_rad_s": SPEED, "velocity_m_s": velocity})
    assert blocks_of(log).velocity == pytest.approx(velocity[:2990].reshape(-1, 10).mean(axis=1))
    with pytest.raises(LogError, match="velocity_m_s or position_m is needed; the log has motor_speed_rad_s"):
        blocks_of(log.replace(velocity_m_s=None))


@pytest.mark.parametrize("sample_time", [1e-4, 1e-3])
@pytest.mark.parametrize("rows", [3, 6, 10])
def test_a_pressure_in_every_few_rows_is_interpolated_linearly_and_averaged_over_blocks(
    rows: int, sample_time: float
) -> None:
    time = sample_time * np.arange(round(3.0 / sample_time))
    rng = np.random.default_rng(3)
    smooth, sampled = 1e6 * np.sin(8.0 * time), np.full(len(time), np.nan)
    sampled[::rows] = smooth[::rows] + 1e4 * rng.standard_normal(len(time[::rows]))
    sampled[len(time) // 2 : len(time) // 2 + round(0.1 / sample_time)] = np.nan  # a real gap must remain a gap
    log = {"motor_speed_rad_s": np.cos(time), "position_m": 1e-2 * np.sin(time), "differential_pressure_pa": sampled}
    blocks = blocks_of(Record(sample_time, log))
    assert blocks.pressure is not None
    there = np.isfinite(blocks.pressure)
    assert 9 <= np.count_nonzero(~there[: len(there) - 2]) <= 12
    centres = BLOCK * (np.arange(len(there)) + 0.5) - 0.5 * sample_time
    off = (blocks.pressure - 1e6 * np.sin(8.0 * centres))[there]
    assert blocks.noise[1] == pytest.approx(1e4 * (rows * sample_time / BLOCK) ** 0.5, rel=0.15)
    # averaged over a block, a line between samples one block apart has less noise than a sample
    assert 0.6 * blocks.noise[1] < np.sqrt(np.mean(off**2)) < 1.25 * blocks.noise[1]


def test_a_log_of_a_few_samples_is_refused() -> None:
    with pytest.raises(LogError, match=r"the log lasts 0\.049 s, but a diagnosis needs 0\.2 s or more"):
        blocks_of(Record(1e-3, {"motor_speed_rad_s": SPEED[:50], "velocity_m_s": SPEED[:50]}))


@pytest.mark.parametrize(("stroke", "given"), [(1.0, None), (1.0, 0.1), (1.0, 0.25), (0.1, 0.1)])
def test_a_circuit_has_an_end_stop_only_if_the_log_reached_it(stroke: float, given: float | None) -> None:
    speed = np.repeat([100.0, -60.0], 4000)
    log = simulate(CIRCUIT, speed, 1e-3, EhaParameters(stroke=stroke))
    actuator = actuator_of(EhaParameters(stroke=given))
    blocks = blocks_of(log)
    (found,) = predicted_outputs(blocks, parameter_rows(actuator.conditions[:1], actuator.circuit, actuator.rated))
    off = (found - blocks.outputs)[blocks.first :]
    assert np.all(np.sqrt(np.mean(off**2, axis=0)) < 0.05 * np.sqrt(np.mean(blocks.outputs**2, axis=0)))


def test_a_circuit_starts_under_pressure_if_its_log_does() -> None:
    p = parameters_for(CONDITIONS["major_friction"])
    run = simulate(CIRCUIT, np.repeat([100.0, -20.0, 0.0, 15.0], 400), 1e-3, p)
    blocks = blocks_of(run.slice(500, len(run)))
    rows = parameter_rows(coordinates_of(circuit_of(p), ACTUATOR.rated)[None], ACTUATOR.circuit, ACTUATOR.rated)
    assert blocks.start_values is not None
    assert blocks.pressure is not None
    size = np.sqrt(np.mean(blocks.pressure**2))
    left, at_rest = (
        np.sqrt(np.mean((predicted_outputs(one, rows)[0, one.first :, 1] - blocks.pressure[one.first :]) ** 2)) / size
        for one in (blocks, replace(blocks, start_values=None))
    )
    assert left < 0.03
    assert at_rest > 0.3


def test_without_pressure_a_circuit_starts_with_the_pressure_of_its_own_friction() -> None:
    p = parameters_for(CONDITIONS["major_friction"])
    run = simulate(CIRCUIT, np.repeat([100.0, -20.0, 0.0, 15.0], 400), 1e-3, p)
    blocks = blocks_of(run.slice(350, len(run)).replace(differential_pressure_pa=None))
    rows = parameter_rows(coordinates_of(circuit_of(p), ACTUATOR.rated)[None], ACTUATOR.circuit, ACTUATOR.rated)
    assert blocks.start_velocity == blocks.velocity[0]
    left, at_rest = (
        np.sqrt(np.mean((velocity_of(one, rows) - one.velocity)[:20] ** 2)) / abs(blocks.start_velocity)
        for one in (blocks, replace(blocks, start_velocity=0.0))
    )
    assert left < 0.05
    assert at_rest > 0.2


def test_a_circuit_under_a_load_starts_at_the_position_and_spring_force_of_its_log() -> None:
    still, area = np.zeros(81 * 10), ACTUATOR.circuit.piston_area
    blocks = Blocks(still, 1e-3, 10, np.zeros(80), np.zeros(80), np.ones(2))
    loaded = replace(ACTUATOR.circuit, load_force=300.0)
    sprung = replace(ACTUATOR.circuit, load_stiffness=2e4)

    def first(one: Blocks, circuit: CircuitParameters) -> tuple[float, float]:
        (found,) = predicted_outputs(one, parameter_rows(ACTUATOR.conditions[:1], circuit, ACTUATOR.rated))
        return float(found[0, 0]), float(found[0, 1])

    held = 300.0 / area
    assert first(blocks, loaded)[1] == pytest.approx(held, rel=0.02)  # at rest, pressure holds the load
    velocity, pressure = first(replace(blocks, raw_start_values=(0.0, -0.02)), replace(loaded, load_force=900.0))
    assert velocity < -0.01  # the piston gives way until its oil is compressed
    assert pressure < 0.5 * 900.0 / area
    assert first(replace(blocks, raw_start_values=(0.0, -0.02)), ACTUATOR.circuit) == first(blocks, ACTUATOR.circuit)
    assert first(replace(blocks, place=0.015), sprung)[1] == pytest.approx(held, rel=0.02)
    assert first(blocks, sprung)[1] == pytest.approx(0.0, abs=0.02 * held)
    before = parameter_rows(ACTUATOR.conditions[:1], sprung, ACTUATOR.rated)[0]
    earlier = replace(blocks, place=0.015, earlier_circuit=(400, before))
    assert first(earlier, ACTUATOR.circuit)[1] == pytest.approx(held, rel=0.1)


def test_a_log_that_begins_at_rest_has_no_initial_pressure() -> None:
    log = simulate(CIRCUIT, SPEED, 1e-3, EhaParameters(), sensors=BENCH, rng=np.random.default_rng(1))
    assert blocks_of(log).start_values is None


def velocity_of(blocks: Blocks, rows: np.ndarray) -> np.ndarray:
    (found,) = predicted_outputs(blocks, rows)
    return found[:, 0]


def healthy_blocks(**more: object) -> tuple[Blocks, np.ndarray]:
    speed = np.repeat([100.0, 40.0], 400)
    empty = np.zeros(80)
    rows = parameter_rows(ACTUATOR.conditions[:1], ACTUATOR.circuit, ACTUATOR.rated)
    return Blocks(np.append(speed, 40.0), 1e-3, 10, empty, empty, np.ones(2), **more), rows  # type: ignore[arg-type]


def test_an_earlier_circuit_runs_up_to_its_sample() -> None:
    plain, rows = healthy_blocks()
    place = list(CONDITIONS).index("major_leakage")
    leaking = parameter_rows(ACTUATOR.conditions[[place]], ACTUATOR.circuit, ACTUATOR.rated)
    before = velocity_of(plain, leaking)
    both = velocity_of(replace(plain, earlier_circuit=(500, leaking[0])), rows)
    np.testing.assert_array_equal(both[:48], before[:48])
    assert both[-10:] == pytest.approx(velocity_of(plain, rows)[-10:], rel=1e-3)
    assert np.abs(both[-10:] - before[-10:]).min() > 1e-3


def test_an_earlier_circuit_is_run_once_for_all_later_circuits(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, rows = healthy_blocks()
    place, asked = list(CONDITIONS).index("major_leakage"), list[int]()
    (leaking,) = parameter_rows(ACTUATOR.conditions[[place]], ACTUATOR.circuit, ACTUATOR.rated)
    original = circuit_runs.circuit_groups

    def counted(starts: np.ndarray, speed: np.ndarray, *more: Any, **how: Any) -> Any:
        asked.append(len(speed))
        return original(starts, speed, *more, **how)

    monkeypatch.setattr(circuit_runs, "circuit_groups", counted)
    changed = replace(plain, earlier_circuit=(500, leaking))
    (first,), (again,) = predicted_outputs(changed, rows), predicted_outputs(changed, rows)
    assert asked == [501, 301, 301]
    np.testing.assert_array_equal(first, again)
    # the sample of the change is given for each circuit
    (whole,) = predicted_outputs(replace(plain, earlier_circuit=(np.array([500]), leaking)), rows)
    size = np.abs(whole).max(axis=0)
    assert np.all(np.abs(first - whole) < (2e-4, 2e-4) * size)
    (between,) = predicted_outputs(
        replace(plain, earlier_circuit=(503, leaking)), rows
    )  # the change is not at the end of a block
    assert asked[-1] == 801
    assert np.all(np.abs(between - first)[:49] < (2e-4, 1e-3) * size)


def test_each_circuit_can_have_its_own_sample_of_change() -> None:
    plain, rows = healthy_blocks()
    place = list(CONDITIONS).index("major_leakage")
    (leaking,) = parameter_rows(ACTUATOR.conditions[[place]], ACTUATOR.circuit, ACTUATOR.rated)
    ends = np.array([200, 500, 650])
    both = predicted_outputs(replace(plain, earlier_circuit=(ends, leaking)), np.repeat(rows, 3, axis=0))
    for end, found in zip(ends, both, strict=True):
        alone = velocity_of(replace(plain, earlier_circuit=(int(end), leaking)), rows)
        assert found[:, 0] == pytest.approx(alone, rel=1e-3, abs=1e-5)
    assert np.abs(both[0, 30:45, 0] - both[1, 30:45, 0]).min() > 1e-3


def test_a_course_of_leakage_raises_all_leakages_and_lowers_viscous_friction() -> None:
    plain, rows = healthy_blocks()
    names = list(CircuitParameters.__dataclass_fields__)
    warm = rows.copy()
    for name in names:
        if name.endswith("leakage") or name == "leakage_coefficient":
            warm[:, names.index(name)] *= 3.0
    warm[:, names.index("friction_linear")] /= 3.0
    course = velocity_of(replace(plain, leakage_course=np.full(801, 3.0)), rows)
    assert course == pytest.approx(velocity_of(plain, warm), rel=1e-12)
    assert course[30] < velocity_of(plain, rows)[30]


def test_a_known_end_stop_holds_the_piston() -> None:
    plain, rows = healthy_blocks(stop=0.01)
    gone = np.cumsum(velocity_of(plain, rows)) * 0.01
    assert gone.max() == pytest.approx(0.01, abs=2e-4)
    assert gone[-1] == pytest.approx(0.01, abs=2e-4)


def test_a_run_settles_at_the_velocity_and_pressure_of_the_steady_state() -> None:
    plain, rows = healthy_blocks()
    (found,) = predicted_outputs(plain, rows)
    velocity, pressure = steady_state(100.0, circuit_of(EhaParameters()))
    assert found[39, 0] == pytest.approx(velocity, rel=0.01)
    assert found[39, 1] == pytest.approx(pressure, rel=0.02)


def test_a_block_is_the_mean_of_its_samples_and_missing_if_most_of_them_are() -> None:
    speed, velocity = SPEED.copy(), np.arange(3000.0)
    velocity[[1, 2, 3, 4, 5]] = np.nan
    velocity[[11, 12, 13, 14, 15, 16]] = np.nan
    blocks = blocks_of(Record(1e-3, {"motor_speed_rad_s": speed, "velocity_m_s": velocity}))
    assert blocks.velocity[0] == pytest.approx(np.mean([0, 6, 7, 8, 9]))
    assert np.isnan(blocks.velocity[1])
    assert blocks.velocity[2] == pytest.approx(24.5)


@pytest.mark.parametrize("position", [True, False])
def test_the_noise_of_blocks_follows_from_that_of_the_sensors(position: bool) -> None:
    rng, time = np.random.default_rng(2), 1e-3 * np.arange(6001)
    travelled, moving = 1e-2 * np.sin(3.0 * time), 3e-2 * np.cos(3.0 * time)
    log = Record(
        1e-3,
        {
            "motor_speed_rad_s": 100.0 * np.cos(3.0 * time),
            "differential_pressure_pa": 1e6 * np.cos(3.0 * time) + 5e3 * rng.standard_normal(6001),
            "velocity_m_s": moving + 2e-3 * rng.standard_normal(6001),
            **({"position_m": travelled + 4e-6 * rng.standard_normal(6001)} if position else {}),
        },
    )
    blocks = blocks_of(log)
    wanted = 2.0**0.5 * 4e-6 / BLOCK if position else 2e-3 / 10.0**0.5
    assert blocks.noise == pytest.approx([wanted, 5e3 / 10.0**0.5], rel=0.1)
    true = 1e-2 * np.diff(np.sin(3.0 * BLOCK * np.arange(len(blocks.velocity) + 1))) / BLOCK
    assert np.std(blocks.velocity - true) == pytest.approx(wanted, rel=0.1)


def test_a_sensor_without_values_in_the_stretch_counts_as_absent() -> None:
    velocity = 0.01 * np.sin(np.arange(3000) * 1e-3)
    out = np.where(np.arange(3000) < 80, 1e5, np.nan)  # it worked only during the first samples, which do not count
    log = Record(1e-3, {"motor_speed_rad_s": SPEED, "velocity_m_s": velocity})
    for lost in (out, np.full(3000, np.nan)):
        blocks = blocks_of(log.replace(differential_pressure_pa=lost))
        assert blocks.pressure is None
        assert blocks.noise.tolist() == blocks_of(log).noise.tolist()
    with pytest.raises(LogError, match="velocity_m_s or position_m is needed"):
        blocks_of(log.replace(velocity_m_s=np.full(3000, np.nan)))


def test_a_rig_without_leakage_or_flow_bias_has_coordinates() -> None:
    tight = replace(EhaParameters(), leakage_coefficient=0.0, flow_bias=0.0)
    found = coordinates_of(tight, 0.1)
    assert np.all(np.isfinite(found))
    pumped = tight.pump_displacement * tight.rated_speed
    least = [1e-3 * pumped / tight.relief_pressure, 1e-3 * pumped]
    assert np.exp(found[:2]) == pytest.approx(least, rel=1e-6, abs=0.0)


@pytest.mark.parametrize(
    "absent", [("quadratic",), ("coulomb",), ("quadratic", "linear"), ("quadratic", "coulomb", "linear")], ids=str
)
def test_a_missing_part_of_friction_becomes_a_thousandth_of_the_relief_force(
    absent: tuple[str, ...],
) -> None:
    p = replace(EhaParameters(), **{f"friction_{part}": 0.0 for part in absent})
    least = 1e-3 * p.relief_pressure * p.piston_area
    bent, rated = p.friction_quadratic * ACTUATOR.rated**2, p.friction_linear * ACTUATOR.rated
    wanted = np.array([p.friction_coulomb, bent, p.friction_coulomb + rated + bent])
    found = np.exp(coordinates_of(p, ACTUATOR.rated)[2:5])
    np.testing.assert_allclose(found, np.maximum(wanted, least), rtol=1e-12)
