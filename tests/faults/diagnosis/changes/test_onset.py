"""A change of condition within a log: its time is found, and the verdict is on the part after it."""

import itertools
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks.diagnosis.population import TEST, draw_logs
from benchmarks.watching.watching import CircuitStream
from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.log_checks.clean import clean_log
from experiments.open_benchmark.kinds import make
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.changes import onset
from faults.diagnosis.changes.onset import (
    MOST_ALARMS,
    SOFTENING_GAIN,
    LastPart,
    find_onset,
    last_part,
    part_of,
    softening_notes,
    two_parts,
)
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.circuits.out_of_model import unexplained_notes
from faults.eha.inject import abrupt_fault
from faults.notes import AgainstCode
from faults.watch.events import Alarm, Event, Ready
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import RIG
from tests.thinned import thinned

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
AT = 3.2


def diagnosed(record: Record) -> Diagnosis:
    return diagnose_clean(clean_log(record, HEALTHY), ACTUATOR)


def changed(condition: str, drive: str, *, pressure: bool, start: float = 0.0) -> Diagnosis:
    rng = np.random.default_rng(11)
    speed = make_drive(drive, 6.0, 1e-3, EhaParameters(), rng)
    path = abrupt_fault(ACTUATOR.circuit, circuit_of(parameters_for(CONDITIONS[condition])), AT)
    log = replace(simulate(CIRCUIT, speed, 1e-3, path, sensors=RIG, rng=rng), start_time=start)
    return diagnosed(log if pressure else log.replace(differential_pressure_pa=None))


def short_log(condition: str | None, start: float = 0.0) -> Record:
    """Return four seconds at 2 ms, with or without a fault that begins after 2.2 s."""
    rng = np.random.default_rng(11)
    speed = make_drive("prbs", 4.0, 2e-3, HEALTHY, rng)
    after = ACTUATOR.circuit if condition is None else circuit_of(parameters_for(CONDITIONS[condition]))
    path = abrupt_fault(ACTUATOR.circuit, after, 2.2)
    return replace(simulate(CIRCUIT, speed, 2e-3, path, sensors=RIG, rng=rng), start_time=start)


@pytest.mark.parametrize(
    ("condition", "pressure"),
    thinned(
        itertools.product(("major_leakage", "major_friction"), (True, False)),
        [("major_leakage", True), ("major_friction", False)],
    ),
)
def test_a_log_is_judged_from_the_onset_of_its_last_condition(condition: str, *, pressure: bool) -> None:
    record = short_log(condition, start=100.0)
    found = last_part(record if pressure else record.replace(differential_pressure_pa=None), ACTUATOR)
    assert found.onset is not None
    assert found.onset.before == "normal"
    assert found.onset.since == pytest.approx(102.2, abs=0.02)
    assert found.onset.ci95[0] < found.onset.since < found.onset.ci95[1]
    assert found.onset.ci95[1] - found.onset.ci95[0] < 0.1
    assert found.record.start_time == pytest.approx(found.onset.since)
    assert len(found.record) == pytest.approx(900, abs=10)
    assert found.blocks.earlier_circuit is not None
    assert found.blocks.earlier_circuit[0] * found.blocks.sample_time == pytest.approx(2.2, abs=0.02)
    assert np.flatnonzero(np.isfinite(found.blocks.velocity))[0] == pytest.approx(220, abs=2)
    assert list(CONDITIONS)[int(np.argmax(found.fits.scores))] == condition


def test_without_pressure_no_onset_is_sought_in_a_log_with_drifting_leakage() -> None:
    record = short_log("major_leakage")
    course = np.exp(0.01 * np.linspace(-1.0, 0.0, len(record)))
    drifts = record.replace(**{LEAKAGE_COURSE: course})
    assert last_part(drifts, ACTUATOR).onset is not None, "the balance of flows told the drift"
    assert last_part(drifts.replace(differential_pressure_pa=None), ACTUATOR).onset is None


@pytest.mark.parametrize("pressure", [True, False])
def test_a_long_log_that_stands_still_at_first_is_judged_where_it_moves(*, pressure: bool) -> None:
    """Before, the first 30 s alone were judged: leakage of a log without pressure was that of the prior, 1.1 L/min."""
    rng = np.random.default_rng(11)
    speed = np.concatenate([np.zeros(round(32.0 / 2e-3)), make_drive("steps", 4.0, 2e-3, HEALTHY, rng)])
    leaks = circuit_of(parameters_for(CONDITIONS["minor_leakage"]))
    record = simulate(CIRCUIT, speed, 2e-3, leaks, sensors=RIG, rng=rng)
    found = diagnosed(record if pressure else record.replace(differential_pressure_pa=None))
    assert found.condition == "minor_leakage"
    assert found.scoreboard.window.start_time == pytest.approx(31.5, abs=0.1)
    assert found.severity["leakage_flow"].value == pytest.approx(6.05, rel=0.1)


def test_oil_that_softens_between_two_parts_is_an_objection_only_without_pressure() -> None:
    blocks = blocks_of(foreign("air_midway", 703).replace(differential_pressure_pa=None))
    two = two_parts(blocks, fit_classes(blocks, ACTUATOR), ACTUATOR)
    assert two is not None
    (note,) = softening_notes(two)
    assert note.code == AgainstCode.OIL_SOFTENS
    assert note.data["share"] < 0.8
    assert 8.0 < note.data["at_s"] < 12.0
    assert not softening_notes(two._replace(fits=two.fits[::-1])), "oil that stiffens"
    assert not softening_notes(two._replace(gain=0.99 * SOFTENING_GAIN))
    assert not softening_notes(two._replace(parts=[replace(one, pressure=one.velocity) for one in two.parts]))
    assert find_onset(blocks, two, ACTUATOR) is None
    elsewhere = replace(two.fits[1], unbent_scores=np.roll(two.fits[1].one_law_scores, 1))
    assert softening_notes(two._replace(fits=[two.fits[0], elsewhere])), "no condition softens the oil"


def test_a_log_with_softening_oil_has_an_objection_and_no_onset() -> None:
    found = last_part(foreign("air_midway", 9707).replace(differential_pressure_pa=None), ACTUATOR)
    assert found.onset is None
    assert [note.code for note in found.against] == [AgainstCode.OIL_SOFTENS]


def test_a_log_in_one_condition_is_judged_as_a_whole() -> None:
    record = short_log(None)
    found = last_part(record, ACTUATOR)
    assert found.onset is None
    assert found.record is record
    assert found.blocks.earlier_circuit is None
    assert np.all(np.isfinite(found.blocks.velocity))


def foreign(kind: str, index: int) -> Record:
    """Return a log of the open benchmark, which is simulated with other physics than the circuits here."""
    return clean_log(Record.from_frame(make(kind, "training", index).log), HEALTHY).record


@pytest.mark.parametrize("index", thinned([7, 17], [7]))
def test_a_piston_that_creeps_at_first_has_no_onset(index: int) -> None:
    assert last_part(foreign("plain", index), ACTUATOR).onset is None


def test_a_chance_gain_of_two_circuits_is_not_an_onset() -> None:
    assert last_part(foreign("plain", 2489), ACTUATOR).onset is None  # two circuits gain 12.1


@pytest.mark.slow
def test_the_onset_of_leakage_is_dated_on_another_actuator() -> None:
    found = last_part(foreign("leakage_sets_in", 2), ACTUATOR)
    assert found.onset is not None
    assert found.onset.before == "normal"
    assert found.onset.ci95[0] <= 4.684 <= found.onset.ci95[1]


def with_bursts(*begins: float) -> Record:
    """Return six seconds at 2 ms of a healthy actuator with bursts of 0.3 s in which Coulomb friction is fivefold."""
    rng = np.random.default_rng(11)
    speed = make_drive("multisine", 6.0, 2e-3, HEALTHY, rng)
    rough = replace(ACTUATOR.circuit, friction_coulomb=5.0 * ACTUATOR.circuit.friction_coulomb)
    times = (0.0, *(time for begin in begins for time in (begin, begin + 0.3)))
    path = ParameterPath(times, (ACTUATOR.circuit, *[rough, ACTUATOR.circuit] * len(begins)))
    return simulate(CIRCUIT, speed, 2e-3, path, sensors=RIG, rng=rng)


def test_no_onset_is_found_after_bursts_of_friction_that_no_circuit_follows() -> None:
    record = with_bursts(0.6, 1.2, 1.9)
    found = last_part(record, ACTUATOR)
    assert found.onset is None
    assert found.record is record
    assert unexplained_notes(found.blocks, found.fits, ACTUATOR)


def alarm(since: float) -> Alarm:
    return Alarm(since + 1.0, "flow", since, (since, since), 9.0, 5.0)


def test_no_onset_is_reported_if_no_circuit_follows_the_part_after_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    record = short_log("major_friction")
    said = [AgainstCode.UNEXPLAINED.note(percent=20.0, channel="velocity")]

    def nothing_follows_the_rest(blocks: Blocks, *_: object) -> list[Note]:
        return said if blocks.earlier_circuit is not None else []

    for logged in (record.replace(differential_pressure_pa=None), record):
        blocks = blocks_of(logged)
        two = two_parts(blocks, fit_classes(blocks, ACTUATOR), ACTUATOR)
        assert two is not None
        assert find_onset(blocks, two, ACTUATOR) is not None
        with monkeypatch.context() as patch:
            patch.setattr(onset, "unexplained_notes", nothing_follows_the_rest)
            assert find_onset(blocks, two, ACTUATOR) is None


def test_stretches_about_the_last_alarms_of_a_long_log_are_searched_until_one_has_an_onset(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alarms: list[Event] = [Ready(60.0, (5.0, 5.0)), *map(alarm, (503.0, 520.0, 540.0, 570.0, 594.0))]
    looked: list[tuple[float, float]] = []

    def last_of(window: Record, _: Actuator) -> LastPart:
        looked.append((window.start_time, window.duration))
        change = object() if window.start_time == changed else None
        nothing: Any = None
        return LastPart(window, window, nothing, nothing, cast("Any", change))

    monkeypatch.setattr(onset, "watch_record", lambda *_, **__: alarms)
    monkeypatch.setattr(onset, "_last_part_of_window", last_of)
    long = Record(0.02, {"motor_speed_rad_s": np.zeros(5001)}, start_time=500.0)  # 100 s long
    changed = 525.0
    assert last_part(long, ACTUATOR).window.start_time == 525.0
    assert looked == [(579.0, pytest.approx(21.0)), (555.0, 30.0), (525.0, 30.0)]
    changed = -1.0
    looked.clear()
    assert last_part(long, ACTUATOR).record is long
    assert len(looked) == MOST_ALARMS + 1
    looked.clear()
    # one of 90 s, and one sampled too slowly for the watch
    for short in (long.slice(0, 4500), replace(long, sample_time=0.06)):
        assert last_part(short, ACTUATOR).window is short
    assert len(looked) == 2
    alarms[1:] = [alarm(503.0)]
    last_part(long, ACTUATOR)
    assert looked[2] == (500.0, 30.0)  # no part begins before the log


@pytest.mark.slow
@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "without"])
@pytest.mark.parametrize(("condition", "drive"), [("minor_leakage", "steps"), ("major_friction", "prbs")])
def test_a_fault_that_starts_within_a_log_is_named_with_its_onset(
    condition: str, drive: str, *, pressure: bool
) -> None:
    found = changed(condition, drive, pressure=pressure)
    onset = found.scoreboard.onset
    assert found.condition == condition
    assert onset is not None
    assert onset.before == "normal"
    assert onset.ci95[0] <= AT <= onset.ci95[1]
    assert onset.ci95[1] - onset.ci95[0] < 0.5


@pytest.mark.slow
def test_the_onset_time_is_on_the_clock_of_the_log() -> None:
    onset = changed("major_leakage", "prbs", pressure=True, start=100.0).scoreboard.onset
    assert onset is not None
    assert onset.since == pytest.approx(100.0 + AT, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("like", [True, False], ids=["the circuit that is fitted", "another circuit"])
def test_a_fault_older_than_the_log_has_no_onset(*, like: bool) -> None:
    for log in draw_logs([TEST + 40], like=like):
        assert diagnosed(log.record).scoreboard.onset is None


@pytest.mark.slow
def test_a_fault_late_in_a_long_log_is_diagnosed_with_its_onset() -> None:
    stream = CircuitStream(3)
    before = [stream.run(60.0), stream.run(30.0)]
    stream.condition = "major_leakage"
    samples = np.vstack([*before, stream.run(20.0)])
    names = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")
    found = diagnosed(Record(1e-3, dict(zip(names, samples.T.copy(), strict=True))))
    assert found.condition == "major_leakage"
    assert found.scoreboard.onset is not None
    assert found.scoreboard.onset.since == pytest.approx(90.0, abs=0.3)


def test_a_part_keeps_the_whole_drive_and_drops_outputs_outside_it() -> None:
    blocks = Blocks(np.zeros(201), 1e-3, 10, np.arange(20.0), None, np.array([1.0]))
    part = part_of(blocks, 5, 12)
    assert np.flatnonzero(np.isfinite(part.velocity)).tolist() == list(range(5, 12))
    assert part.speed is blocks.speed


def test_the_interval_of_the_onset_covers_95_percent() -> None:
    assert pytest.approx(0.5 * float(chdtri(1, 0.05)), abs=1e-3) == onset.INTERVAL_DROP


@pytest.mark.parametrize(("lasting", "wide"), [(0.3, 4), (1.0, 4), (3.0, 13)])
def test_lasting_misfit_widens_the_interval_of_the_onset(
    lasting: float, wide: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, best = 120, 100
    blocks = Blocks(np.zeros(2001), 1e-3, 10, np.zeros(200), None, np.array([1.0]))

    def run(changing: Blocks, rows: np.ndarray) -> list[np.ndarray]:
        assert changing.earlier_circuit is not None
        assert len(rows) == len(np.atleast_1d(changing.earlier_circuit[0]))
        costs = 0.1 * (np.atleast_1d(changing.earlier_circuit[0]) / 10 - best) ** 2  # exceeds 1.92 beyond 4.4 blocks
        return [np.full((200, 1), np.sqrt(2.0 * cost / (200 - blocks.first))) for cost in costs]

    monkeypatch.setattr(onset, "predicted_outputs", run)
    monkeypatch.setattr(onset, "least_scales", lambda _: 1.0)
    monkeypatch.setattr(onset, "lasting_misfit", lambda *_: lasting)
    circuits = np.zeros((2, len(onset.COORDINATES)))
    assert onset._change_block(blocks, *circuits, place, ACTUATOR) == (best - wide - 1, best, best + wide + 1)
