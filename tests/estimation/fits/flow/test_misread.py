"""Wrong signs and units that fits identify if correlations between channels do not."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.finding import Outcome
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import misread as misread_module
from estimation.fits.flow.misread import FOREIGN, KIN, MOST_FITTED, CorrectedLogs
from estimation.fits.flow.plain import FitStart, Logged
from estimation.fits.flow.slips import DEGREES, PSI, SLIPS, Slip
from estimation.fits.greybox.work_limit import Work
from estimation.fits.hypotheses import DELIVERY, OFFSET
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.log_checks.channel_physics import channel_mistakes
from estimation.log_checks.unit_slips import RPM
from estimation.notes import ChannelCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import made_fit
from tests.thinned import thinned

RIG = EhaParameters()
SAID = {SPEED: "rpm read as rad/s", PRESSURE: "a wrong sign of differential_pressure_pa"}


def log(softer: float = 1.0) -> Record:
    """Return a log with one second of steps, which is too short for correlations."""
    rng, p = np.random.default_rng(8), replace(RIG, bulk_modulus=RIG.bulk_modulus / softer)
    return simulate(CIRCUIT, make_drive("steps", 1.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


@pytest.mark.parametrize("turned", thinned([SPEED, PRESSURE], [SPEED]))
def test_a_short_log_names_a_unit_or_sign_that_correlations_do_not(
    turned: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(misread_module, "SLIPS", [one for one in SLIPS if one.channel == turned][:2])
    sound = log()
    wrong = sound.replace(**{turned: sound[turned] * (RPM if turned == SPEED else -1.0)})
    assert channel_mistakes(wrong, RIG) == ()
    told = estimate_bulk_modulus(wrong, RIG)
    assert (told.outcome, told.value, told.gate.passed) == (Outcome.MISMATCH, None, False)
    (note,) = told.gate.reasons
    assert note.code == ChannelCode.CHANNEL_MISREAD
    assert note.data["channel"] == turned
    assert SAID[turned] in str(note)


@pytest.mark.parametrize(
    ("rests", "missing", "lengths"), [(0, 0, [2001, 5000]), (1500, 2000, [4001, 5000]), (1500, 3500, [5000])]
)
def test_slips_are_tested_once_and_first_on_the_log_up_to_two_seconds_of_pump_motion(
    rests: int, missing: int, lengths: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A speed that was missing throughout the first 2 s caused an error."""
    seen: list[int] = []
    fit = made_fit(50.0, 0.01 * RIG.bulk_modulus, 1e5)

    def right_with(slips: tuple[Slip, ...], logged: Logged, _: EhaParameters) -> Any:
        seen.append(len(logged.record))
        return fit if slips == (SLIPS[0],) else None

    monkeypatch.setattr(misread_module, "SLIPS", SLIPS[:1])
    monkeypatch.setattr(misread_module, "_rough_misfit", lambda *_: 1.0)
    monkeypatch.setattr(misread_module, "_fit_if_corrected", right_with)
    speed, position = np.ones(5000), np.zeros(5000)
    speed[:rests], position[:missing] = 0.0, np.nan
    record = Record(1e-3, {SPEED: speed, POSITION: position, PRESSURE: np.arange(5000.0)})
    plain: Any = SimpleNamespace(explains=lambda _: False)
    corrected = CorrectedLogs(Logged(record, {SPEED: 1.0, POSITION: 1.0, PRESSURE: 1.0}), RIG)
    assert [bool(corrected.misread(plain, fit)) for _ in range(2)] == [True, True]
    assert seen == lengths
    dead = CorrectedLogs(Logged(record, {PRESSURE: float(np.var(record[PRESSURE]))}), RIG)
    assert dead.misread(plain, fit) is None


def test_a_log_that_is_fitted_again_is_tested_for_slips_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first minimum may fit the rig, and a lower one may not."""
    plains = [SimpleNamespace(best=best, explains=lambda _: True) for best in ("kin", "foreign")]
    nothing: Any = None
    monkeypatch.setattr(flow_fit, "plain_fits", lambda *_: plains.pop(0))
    monkeypatch.setattr(flow_fit, "with_stiff_oil", lambda *_: None)
    monkeypatch.setattr(flow_fit, "with_implicit_steps", lambda *_: None)
    monkeypatch.setattr(flow_fit, "with_motor_course", lambda _, plain: plain)
    monkeypatch.setattr(flow_fit, "with_open_turns", lambda _, plain: plain)
    monkeypatch.setattr(flow_fit, "settled_offset", lambda plain, strange, *_: (plain, strange))
    monkeypatch.setattr(flow_fit, "_asked", lambda *_: ((DELIVERY,), ()))
    monkeypatch.setattr(flow_fit, "_ask", lambda *_: ("a lower valley", ()))
    monkeypatch.setattr(flow_fit, "_plain_start", lambda *_: FitStart(RIG, 2e8))
    corrected: Any = SimpleNamespace(
        logged=nothing,
        is_kin=lambda _, found: found == "kin",
        is_sound=lambda *_: True,
        misread=lambda _, found, **_named: found == "foreign" or None,
    )
    answer = flow_fit._answer(corrected, FitStart(RIG, 2e8), nothing, nothing, Work())
    assert (answer.plain.best, answer.asked, plains) == ("foreign", (), [])


@pytest.mark.parametrize("named", ["pressure_offset", "delivery"])
def test_slips_are_tested_before_every_hypothesis_except_a_pressure_offset(
    monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    """A pump that delivers a tenth of its flow looks like a speed in rpm; no slip looks like an offset."""
    plain: Any = SimpleNamespace(best="foreign", explains=lambda _: False)
    strange: Any = SimpleNamespace(names=(named,), fit="kin")
    nothing: Any = None
    monkeypatch.setattr(flow_fit, "plain_fits", lambda *_: plain)
    monkeypatch.setattr(flow_fit, "with_stiff_oil", lambda *_: None)
    monkeypatch.setattr(flow_fit, "with_implicit_steps", lambda *_: None)
    monkeypatch.setattr(flow_fit, "with_motor_course", lambda _, plain: plain)
    monkeypatch.setattr(flow_fit, "with_open_turns", lambda _, plain: plain)
    monkeypatch.setattr(flow_fit, "settled_offset", lambda plain, strange, *_: (plain, strange))
    monkeypatch.setattr(flow_fit, "_asked", lambda *_: ((DELIVERY, OFFSET), ()))
    by_offset = named == OFFSET.name
    monkeypatch.setattr(flow_fit, "_ask", lambda _, asked, *__: (strange if by_offset or len(asked) > 1 else None, ()))
    monkeypatch.setattr(flow_fit, "_plain_start", lambda *_: None)
    monkeypatch.setattr(flow_fit, "quieter_start", lambda *_: None)
    monkeypatch.setattr(CorrectedLogs, "is_kin", lambda _, __, found: found == "kin")
    monkeypatch.setattr(CorrectedLogs, "misread", lambda *_, **_named: True)
    answer = flow_fit._answer(CorrectedLogs(nothing, RIG), FitStart(RIG, 2e8), nothing, nothing, Work())
    assert (answer.strange is strange) == by_offset


@pytest.mark.parametrize("noise", [0.0, 2e3])
def test_a_dead_pressure_sensor_is_not_reported_as_a_misread_channel(noise: float) -> None:
    """Nothing moved, so a pump a tenth as fast explained the log best."""
    sound = log()
    still = {name: np.zeros(len(sound)) for name in ("position_m", "velocity_m_s")}
    dead = noise * np.random.default_rng(1).standard_normal(len(sound))
    told = estimate_bulk_modulus(sound.replace(**still, **{PRESSURE: dead}), RIG)
    assert not any(isinstance(note.code, ChannelCode) for note in told.gate.reasons)


@pytest.mark.parametrize("softer", [1.0, 5.0])
def test_soft_oil_in_a_short_log_is_not_reported_as_a_misread_channel(softer: float) -> None:
    told = estimate_bulk_modulus(log(softer), RIG)
    assert not any(isinstance(note.code, ChannelCode) for note in told.gate.reasons)


@pytest.mark.parametrize(
    ("times", "std", "lost", "explained", "kin"),
    [
        (1.0, 0.01, 1.0, True, True),
        (1.1 / FOREIGN, 0.01, 1.0, True, True),
        (0.9 / FOREIGN, 0.01, 1.0, True, False),
        (0.9 / FOREIGN, 0.3, 1.0, True, True),
        (0.9 / FOREIGN, 0.3, 1.0, False, False),
        (1.1 * FOREIGN, 0.01, 1.0, True, False),
        (1.0, 0.01, 9.0, True, False),
    ],
)
def test_a_fit_is_foreign_to_the_rig_if_its_oil_or_pump_losses_are_surely_out_of_range(
    times: float, std: float, lost: float, explained: bool, kin: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(CorrectedLogs, "_sliding_excess", 0.0)
    assert KIN < FOREIGN
    modulus = times * RIG.bulk_modulus
    values = {"bulk_modulus": modulus, "leakage_coefficient": 4e-12, "flow_bias": lost * RIG.flow_bias}
    deviations = {"bulk_modulus": std * modulus, "leakage_coefficient": 1e-13, "flow_bias": 1e-8}
    fit = replace(made_fit(50.0, modulus, 1e5), values=values, std=deviations)
    plain: Any = SimpleNamespace(explains=lambda _: explained)
    nothing: Any = SimpleNamespace(record=None)
    assert CorrectedLogs(nothing, RIG).is_kin(plain, fit) is kin


def test_oil_seven_times_stiffer_than_the_rigs_is_not_mistaken_for_a_pressure_unit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Pressure that reads ten times too high looks like such stiff oil; friction distinguishes the two."""
    monkeypatch.setattr(misread_module, "SLIPS", [one for one in SLIPS if one.channel == PRESSURE])
    stiff = log(1 / (1.05 * FOREIGN))
    found = estimate_bulk_modulus(stiff, RIG)
    assert found.gate.passed
    assert found.value is not None
    assert abs(found.value / (1.05 * FOREIGN * RIG.bulk_modulus) - 1.0) < 0.02
    (note,) = estimate_bulk_modulus(log().replace(**{PRESSURE: 10.0 * log()[PRESSURE]}), RIG).gate.reasons
    assert "bar read as MPa" in str(note)


@pytest.fixture(params=[False, pytest.param(True, marks=pytest.mark.slow)], ids=["slips alone", "whole search"])
def _strange_rigs_are_searched_for(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """No hypothesis about the rig explains a log in another unit, and most of the work is to find that out."""
    if not request.param:
        monkeypatch.setattr(flow_fit, "_ask", lambda *_: (None, ()))


@pytest.mark.usefixtures("_strange_rigs_are_searched_for")
@pytest.mark.parametrize(
    ("wrong", "channel", "said"),
    [
        ({SPEED: RPM, PRESSURE: -1.0}, f"{SPEED} and {PRESSURE}", "rpm read as rad/s and a wrong sign of"),
        ({PRESSURE: 1e3 / PSI}, PRESSURE, "psi read as kPa"),
        ({SPEED: DEGREES}, SPEED, "deg/s read as rad/s"),
    ],
)
def test_two_slips_together_and_unit_factors_within_the_range_of_oils_are_identified(
    wrong: dict[str, float], channel: str, said: str
) -> None:
    """A pressure in psi, read as kPa, passed with bulk modulus 85 % too low.

    Two slips together were named in half of such logs: after a first fit at 500 GPa, noise of motor speed explained
    them.
    """
    sound = log()
    read = sound.replace(**{name: times * sound[name] for name, times in wrong.items()})
    (note,) = estimate_bulk_modulus(read, RIG).gate.reasons
    assert note.code == ChannelCode.CHANNEL_MISREAD
    assert note.data["channel"] == channel
    assert said in str(note)


@pytest.mark.usefixtures("_strange_rigs_are_searched_for")
def test_slips_that_a_rough_search_refutes_are_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted: list[tuple[Slip, ...]] = []
    whole = misread_module._fit_if_corrected
    monkeypatch.setattr(
        misread_module, "_fit_if_corrected", lambda slips, *rest: fitted.append(slips) or whole(slips, *rest)
    )
    read = log().replace(**{PRESSURE: -log()[PRESSURE]})
    assert not estimate_bulk_modulus(read, RIG).gate.passed
    assert [slips[0].factor for slips in fitted if slips[0].channel == PRESSURE] == [-1.0]
    assert len(fitted) <= MOST_FITTED


@pytest.mark.usefixtures("_strange_rigs_are_searched_for")
@pytest.mark.parametrize(("times", "passed"), [(1.0, True), (-1.0, False)])
def test_fits_and_slip_detection_work_for_a_rig_file_without_coulomb_friction(times: float, passed: bool) -> None:
    """Both failed on every log, with a division by zero."""
    sound = log()
    read = sound.replace(**{PRESSURE: times * sound[PRESSURE]})
    found = estimate_bulk_modulus(read, replace(RIG, friction_coulomb=0.0))
    assert found.gate.passed == passed
    assert [note.code for note in found.gate.reasons] == ([] if passed else [ChannelCode.CHANNEL_MISREAD])


def test_among_equally_good_units_the_one_whose_pressure_suits_the_rigs_friction_is_fitted_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A pressure in psi, read as bar, was called kPa or MPa: five units explained it, and only four were fitted."""
    pressures = [one for one in SLIPS if one.channel == PRESSURE]
    monkeypatch.setattr(misread_module, "_rough_misfit", lambda *_: 0.9)
    right = log()
    wrong = right.replace(**{PRESSURE: right[PRESSURE] * 1e5 / PSI})
    read = Logged(wrong, {PRESSURE: 1e6, POSITION: 1e-12, SPEED: 1e-2})
    hopeful = misread_module._hopeful_slips([(one,) for one in pressures], read, RIG)
    assert len(hopeful) == MOST_FITTED
    assert hopeful[0][0].said == "psi read as bar"
