"""Which fault outside the nine is named or not excluded, given the gain of each circuit; the fits are made up."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from faults.conditions import CONDITIONS
from faults.diagnosis import by_circuits
from faults.diagnosis.beyond_nine import faulty_circuits, other_faults, sound_circuit, wear
from faults.diagnosis.beyond_nine.left_open import LEAST_REPORTED, STUCK_VALVE_PRIOR
from faults.diagnosis.beyond_nine.other_faults import OutsideFaults, faults_outside
from faults.diagnosis.calibration import shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import PointFit
from faults.diagnosis.circuits.pressure_scale import PRESSURE_SCALE
from faults.diagnosis.evidence import Scoreboard
from faults.notes import AgainstCode, ClassCode
from plant.eha.circuit_parameters import CircuitParameters
from tests.faults.diagnosis.short_logs import ACTUATOR, PAPER, PRESSURE, blocks, log

SOUND = ACTUATOR.circuit
LOG = blocks(pressure=False)
MAJOR = float(np.exp(ACTUATOR.conditions[list(CONDITIONS).index("major_leakage"), COORDINATES.index("leakage")]))
OUTSIDE, EARLY = AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.RELIEF_EARLY
Score = Callable[[CircuitParameters], float]


def fits(score: float) -> Any:
    return SimpleNamespace(scores=np.array([score - 9.0, score]), best=made_fit_at(np.full(7, score)))


def made_fit_at(place: Any) -> PointFit:
    return PointFit(place, 0.0, np.eye(7), 0.05 * LOG.rms, LOG.outputs, np.zeros((7, *LOG.outputs.shape)))


def decided(monkeypatch: pytest.MonkeyPatch, score: Score) -> tuple[Any, Any, list[tuple[Any, bool]]]:
    """Return the reasons and the open faults for given scores, and which circuits were fitted, with a start or not."""
    found, asked = looked(monkeypatch, score)
    return found.against, found.open, asked


def looked(
    monkeypatch: pytest.MonkeyPatch, score: Score, pressure: float = 1e6
) -> tuple[OutsideFaults, list[tuple[Any, bool]]]:
    asked: list[tuple[Any, bool]] = []

    def fitted(_: Any, actuator: Any, *, runs: Any, start: Any = None, **_limits: float) -> Any:  # noqa: ARG001
        asked.append((actuator.circuit, start is not None))
        return fits(score(actuator.circuit))

    use(monkeypatch, fitted, pressure)
    return faults_outside(LOG, fits(0.0), ACTUATOR), asked


def use(monkeypatch: pytest.MonkeyPatch, fitted: Callable[..., Any], pressure: float = 1e6) -> None:
    """Have every circuit fitted by a function, without a run; the largest pressure is as given [Pa]."""
    for module in (faulty_circuits, other_faults, sound_circuit):
        monkeypatch.setattr(module, "fit_classes", fitted)
    for module in (faulty_circuits, other_faults):
        monkeypatch.setattr(module, "nominal_runs", lambda *_: np.zeros((9, 1, 1)))
        monkeypatch.setattr(module, "largest_pressure", lambda *_: pressure)
    monkeypatch.setattr(faulty_circuits, "misfit", lambda *_: 0.0)


def worn(circuit: CircuitParameters) -> float:
    return round(circuit.pump_displacement / SOUND.pump_displacement, 6)


@pytest.mark.parametrize(("gain", "named"), [(3.9, False), (4.1, True)])
def test_a_worn_pump_is_named_from_a_gain_of_four_above_its_prior(
    gain: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    gain += 0.5 * (np.log(0.9) / 0.15) ** 2 + np.log(2.0)
    against, open_, _ = decided(
        monkeypatch, lambda one: gain if worn(one) == 0.9 else -30.0 if worn(one) < 0.9 else 0.0
    )
    if named:
        assert [(note.code, note.data["percent"]) for note in against] == [
            (AgainstCode.PUMP_DELIVERS_LESS, pytest.approx(90.0))
        ]
        assert open_ == ()
    else:
        assert against == ()
        assert "worn pump" in open_[0].data["faults"]


@pytest.mark.parametrize(("gain", "open_"), [(-2.9, True), (-3.1, False)])
def test_a_fault_is_excluded_below_a_gain_of_minus_three(
    gain: float, open_: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = {"makeup_conductance", "pump_case_leakage"}

    def score(one: CircuitParameters) -> float:
        same = all(
            getattr(one, name) == getattr(SOUND, name) for name in SOUND.__dataclass_fields__ if name not in sound
        )
        return 0.0 if same and type(one) is type(SOUND) else gain if worn(one) == 0.7 else -9.0

    against, found, _ = decided(monkeypatch, score)
    assert against == ()
    assert [(note.code, note.data["faults"]) for note in found] == (
        [(ClassCode.NOT_EXCLUDED, "a worn pump")] if open_ else []
    )


@pytest.mark.parametrize(("best", "open_"), [(-2.9, True), (-3.1, False)])
def test_scores_with_worn_pumps_are_returned_only_if_wear_is_not_excluded(
    best: float, open_: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    scores = {1.0: 0.0, 0.7: -8.0, 0.75: -7.0, 0.8: best, 0.85: -6.0, 0.9: -5.0}
    found, _ = looked(monkeypatch, lambda one: scores[worn(one)] if type(one) is type(SOUND) else 1.0)
    assert "a make-up valve that leaks" in found.open[0].data["faults"]
    if open_:
        assert found.worn_scores is not None
        assert found.worn_scores.tolist() == [[score - 9.0, score] for score in (0.0, -8.0, -7.0, best, -6.0, -5.0)]
    else:
        assert found.worn_scores is None


@pytest.mark.parametrize("gain", [-2.9, -1.0, 1.0, 3.0])
def test_a_well_worn_pump_that_is_not_excluded_takes_its_probability_from_the_conditions(
    gain: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    scores = {1.0: 0.0, 0.7: -9.0, 0.75: -9.0, 0.8: gain, 0.85: -9.0, 0.9: -9.0}
    found, _ = looked(monkeypatch, lambda one: scores[worn(one)] if type(one) is type(SOUND) else -9.0, np.nan)
    gains = np.array([-9.0, -9.0, gain])
    odds = 0.5 * float(np.sum(np.exp(gains - 0.5 * (np.log([0.7, 0.75, 0.8]) / 0.15) ** 2)))
    share = odds / (1.0 + odds)
    assert found.faulty == pytest.approx(share)
    percent = f" ({100.0 * share:.0f} %)" if share > LEAST_REPORTED else ""
    assert found.open[0].data["faults"] == f"a worn pump{percent}"
    monkeypatch.setattr(wear, "faults_outside", lambda *_: found)
    nothing = {name: np.zeros(9) for name in ("models", "innovations", "parameters")}
    board = Scoreboard(nothing, LOG, SimpleNamespace(), None, None)  # type: ignore[arg-type]
    told = Diagnosis({}, (), {}, {}, {}, (), board)
    monkeypatch.setattr(wear, "summed_over_wear", lambda *_: {"normal": 0.75, "minor_leakage": 0.25})
    probabilities = wear.with_other_faults(told, ACTUATOR, shipped_calibration()).probabilities
    assert probabilities == pytest.approx({"normal": 0.75 * (1.0 - share), "minor_leakage": 0.25 * (1.0 - share)})


@pytest.mark.parametrize("gain", [-2.9, 0.0, 3.9])
def test_a_stuck_valve_that_is_not_excluded_has_even_odds_at_the_gain_that_names_it(
    gain: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stuck valve that a log cannot distinguish from a sound one keeps its prior probability."""

    def score(one: CircuitParameters) -> float:
        stuck = getattr(one, "makeup_shut_b", 0.0) == 1.0
        return gain if stuck else 0.0 if type(one) is type(SOUND) and worn(one) == 1.0 else -9.0

    found, _ = looked(monkeypatch, score, np.nan)
    odds = max(np.exp(gain - 4.0), np.exp(min(gain, 0.0)) * STUCK_VALVE_PRIOR / (1.0 - STUCK_VALVE_PRIOR))
    assert found.faulty == pytest.approx(odds / (1.0 + odds))
    said = f" ({100.0 * found.faulty:.0f} %)" if gain >= 0.0 else ""
    assert found.open[0].data["faults"] == f"a make-up valve that is stuck shut{said}"


@pytest.mark.parametrize(("gain", "named", "said"), [(6.6, True, False), (6.4, False, True), (0.0, False, True)])
def test_the_gain_of_a_low_relief_valve_is_averaged_over_its_possible_settings(
    gain: float, named: bool, said: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def score(one: CircuitParameters) -> float:
        return gain if one.relief_pressure == 9e5 else 0.0 if one == SOUND else -9.0

    against, open_, _ = decided(monkeypatch, score)
    assert [note.code for note in against] == ([AgainstCode.RELIEF_EARLY] if named else [])
    assert bool(open_ and faulty_circuits.EARLY in open_[0].data["faults"]) == said


@pytest.mark.parametrize(("pressure", "off", "named"), [(1e6, 0.5, False), (3.5e6, 0.5, True), (3.5e6, 0.1, False)])
def test_a_low_relief_valve_is_named_if_its_stated_setting_needs_an_implausible_pressure_scale(
    pressure: float, off: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a log whose valve opened at 22 instead of 34 bar, each circuit made all pressures half as large again."""
    places = ACTUATOR.conditions[1] + np.outer([0.0, off], PRESSURE_SCALE)

    def fitted(_: Any, actuator: Any, **__: Any) -> Any:
        place = places[int(actuator.circuit.relief_pressure == SOUND.relief_pressure)]
        return SimpleNamespace(scores=np.array([-9.0, 0.0]), best=made_fit_at(place))

    use(monkeypatch, fitted, pressure)
    against = faults_outside(LOG, fitted(LOG, ACTUATOR), ACTUATOR).against
    assert [note.code for note in against] == ([AgainstCode.RELIEF_EARLY] if named else [])


def test_the_search_for_a_fault_ends_if_it_cannot_come_within_twenty_of_the_sound_circuit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wanted: list[float] = []

    def fitted(_: Any, actuator: Any, **how: Any) -> Any:
        wanted.extend([how["wanted"]] if "wanted" in how else [])
        return fits(3.0 if actuator.circuit.makeup_conductance != SOUND.makeup_conductance else 0.0)

    use(monkeypatch, fitted)
    faults_outside(LOG, fits(0.0), ACTUATOR)
    # five pumps twice, two relief settings, and for each make-up valve four blocked shares and two seat leakages
    assert len(wanted) == 10 + 2 + 2 * (len(faulty_circuits.SHUT_SHARES) + 2)
    assert set(wanted) == {30.0 * (20.0 - 3.0)}


def test_a_worn_pump_is_compared_with_the_refitted_sound_pump(monkeypatch: pytest.MonkeyPatch) -> None:
    scores, asked = {1.0: 0.0, 0.7: -9.0, 0.75: -9.0, 0.8: 5.0, 0.85: -9.0, 0.9: -9.0}, list[float]()

    def score(one: CircuitParameters) -> float:
        if type(one) is not type(SOUND):
            return -9.0
        asked.append(worn(one))
        return 3.0 if worn(one) == 1.0 and 0.9 in asked else scores[worn(one)]

    found, _ = looked(monkeypatch, score, np.nan)
    assert found.worn_scores is not None
    assert found.worn_scores[:, 1].tolist() == [3.0, -9.0, -9.0, 5.0, -9.0, -9.0]
    odds = 0.5 * np.exp(2.0 - 0.5 * (np.log(0.8) / 0.15) ** 2)
    assert found.faulty == pytest.approx(odds / (1.0 + odds), rel=1e-3)


def test_every_fault_is_compared_with_the_sound_circuit_as_it_is_found_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """The gain of a stuck valve stayed at 11 when the sound circuit had gained 15: it was called certain."""
    early = list[bool]()

    def score(one: CircuitParameters) -> float:
        early.append(one.relief_pressure < SOUND.relief_pressure)
        stuck = 6.0 if getattr(one, "makeup_shut_a", 0.0) > 0.0 else 0.0
        return 9.0 if early[-1] else 8.0 if one == SOUND and any(early) else stuck

    found, _ = looked(monkeypatch, score)
    assert not found.against
    assert found.faulty < 0.03


@pytest.mark.parametrize(("rough", "thorough"), [(-7.9, True), (-8.1, False)])
def test_a_worn_pump_gets_a_thorough_search_if_it_is_within_eight_after_a_rough_one(
    rough: float, thorough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, _, asked = decided(monkeypatch, lambda one: rough if worn(one) < 1.0 else 0.0)
    tries = {share: [begun for one, begun in asked if worn(one) == share] for share in (0.7, 0.8, 0.9)}
    assert tries == dict.fromkeys((0.7, 0.8, 0.9), [True, False] if thorough else [True])


@pytest.mark.parametrize(
    ("pressure", "settings"), [(1e6, {7.5e5, 9e5}), (0.0, set()), (np.nan, set()), (np.inf, set())]
)
def test_low_relief_settings_are_tried_only_below_a_finite_largest_pressure(
    pressure: float, settings: set[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, asked = looked(monkeypatch, lambda _: 0.0, pressure)
    assert {round(one.relief_pressure, 3) for one, _ in asked} - {SOUND.relief_pressure} == settings


def test_faults_are_tried_in_the_sound_circuit_with_the_highest_score(monkeypatch: pytest.MonkeyPatch) -> None:
    wide = 5.0 * SOUND.makeup_conductance

    def score(one: CircuitParameters) -> float:
        return 50.0 if one.makeup_conductance == wide and one.pump_case_leakage == 0.0 else 0.0

    _, _, asked = decided(monkeypatch, score)
    sound = [(one.makeup_conductance / SOUND.makeup_conductance, one.pump_case_leakage > 0.0) for one, _ in asked[:3]]
    assert sound == [(1.0, False), (pytest.approx(5.0), True), (pytest.approx(5.0), False)]
    faulty = [one for one, _ in asked[3:]]
    assert all(one.pump_case_leakage == 0.0 and one.makeup_conductance == wide for one in faulty)
    seats = {
        (side, round(getattr(one, f"seat_leakage_{side}") / MAJOR, 6))
        for one in faulty
        for side in "ab"
        if getattr(one, f"seat_leakage_{side}", 0.0) > 0.0
    }
    assert seats == {(side, size) for side in "ab" for size in (0.4, 1.0)}
    shut = {side for one in faulty for side in "ab" if getattr(one, f"makeup_shut_{side}", 0.0) == 1.0}
    assert shut == {"a", "b"}


@pytest.mark.parametrize(
    ("said", "lies", "found", "left"),
    [
        (AgainstCode.BETWEEN_CONDITIONS, False, None, []),
        (OUTSIDE, True, None, [OUTSIDE]),
        (OUTSIDE, True, EARLY, [EARLY, OUTSIDE]),
        (AgainstCode.BETWEEN_CONDITIONS, False, EARLY, [EARLY]),
        (AgainstCode.NONE_FITS, False, EARLY, [AgainstCode.NONE_FITS]),
    ],
)
def test_the_objection_outside_conditions_is_dropped_if_lasting_errors_explain_it_but_faults_are_kept(
    said: AgainstCode,
    lies: bool,
    found: AgainstCode | None,
    left: list[AgainstCode],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = {AgainstCode.BETWEEN_CONDITIONS: {"leakage": 0.5, "friction": 0.0}, AgainstCode.NONE_FITS: {"percent": 90.0}}
    monkeypatch.setattr(wear, "faults_outside", lambda *_: OutsideFaults(() if found is None else (found.note(),)))
    monkeypatch.setattr(wear, "is_outside_conditions", lambda *_: lies)
    board = Scoreboard({}, LOG, SimpleNamespace(), None, None)  # type: ignore[arg-type]
    told = Diagnosis({"normal": 1.0}, (said.note(**data.get(said, {})),), {}, {}, {}, (), board)
    after = wear.with_other_faults(told, ACTUATOR, shipped_calibration())
    assert [note.code for note in after.against] == left


@pytest.mark.parametrize("near", [-1.0, -1e3])
def test_a_diagnosis_flags_a_log_as_outside_if_every_circuit_is_far_from_the_conditions(
    near: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(by_circuits, "nearest_score", lambda *_: near)
    monkeypatch.setattr(by_circuits, "with_other_faults", lambda found, *_: found)
    clean = clean_log(log().replace(**{PRESSURE: None}), PAPER)
    codes = {note.code for note in by_circuits.diagnose_clean(clean, ACTUATOR).against}
    assert bool(codes & {AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.BETWEEN_CONDITIONS}) == (near < -100.0)


@pytest.mark.parametrize(("pressure", "percent"), [(3.4e5, "2"), (8e5, "1"), (3e6, None), (5e6, None)])
def test_a_low_relief_valve_that_never_opened_in_a_log_keeps_its_prior_probability(
    pressure: float, percent: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before, it kept a tenth of its prior: only the settings just below the largest pressure were counted."""
    found, _ = looked(monkeypatch, lambda one: 0.0 if one == SOUND else -20.0, pressure)
    hidden = np.exp(-4.0) * np.clip(np.log10(SOUND.relief_pressure / pressure), 0.0, 1.0)
    assert found.faulty == pytest.approx(hidden / (1.0 + hidden))
    said = [str(note.data["faults"]) for note in found.open]
    above = f"{faulty_circuits.EARLY}, above {1e-5 * pressure:.2g} bar ({percent} %)"
    assert said == ([] if percent is None else [above])


@pytest.mark.parametrize("moves", [False, True])
def test_the_note_on_an_open_fault_states_the_condition_with_that_fault(
    moves: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ahead(*, first: bool) -> Any:
        scores = np.array([0.0, -9.0] if first else [-9.0, 0.0])
        return SimpleNamespace(scores=scores, best=fits(0.0).best)

    def fitted(_: Any, actuator: Any, **__: Any) -> Any:
        # a low setting is excluded, unless it is above all pressures of the log
        if actuator.circuit.relief_pressure < SOUND.relief_pressure:
            return SimpleNamespace(scores=np.array([-20.0, -29.0]), best=ahead(first=True).best)
        leaks = getattr(actuator.circuit, "seat_leakage_a", 0.0) > 0.0
        return ahead(first=moves) if leaks else ahead(first=False) if actuator.circuit == SOUND else fits(-9.0)

    use(monkeypatch, fitted, 5e5)
    (note,) = faults_outside(LOG, ahead(first=False), ACTUATOR).open
    same = "the condition would be the same"
    leaky = "with a make-up valve that leaks it would be normal"
    assert note.data["condition"] == (f"{same}, but {leaky}" if moves else same)
