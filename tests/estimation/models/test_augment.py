"""Parameters become states: the model is unchanged, bounds hold, and changes are followed."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.filters.ekf import ekf
from estimation.filters.run import Estimate, run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.models.augment import AIR_FRACTION, AUGMENTABLE, augmented, augmented_prior
from estimation.models.eha_forms import ACCELERATION_FORM, BULK_MODULUS, FORMS, PRESSURE_FORM
from estimation.models.model import ProcessModel
from faults.eha.inject import abrupt_fault
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = EhaParameters()
STATE = (0.01, 0.02, 4e5, 1.8e8)


def parameters() -> SimpleNamespace:
    return SimpleNamespace(**{field.name: getattr(RIG, field.name) for field in fields(RIG)})


@pytest.mark.parametrize("name", [name for name in AUGMENTABLE if name != AIR_FRACTION])
@pytest.mark.parametrize("model", FORMS.values(), ids=FORMS)
def test_the_augmented_step_equals_the_models_at_the_rigs_parameter_value(model: ProcessModel, name: str) -> None:
    wide = augmented(model, [name])
    value = getattr(RIG, name)
    plain = model.step(STATE, (100.0, 101.0), parameters(), 1e-4)
    assert wide.step((*STATE, value), (100.0, 101.0), parameters(), 1e-4) == (*plain, value)


def test_a_parameter_that_is_a_state_is_not_read_from_the_rig() -> None:
    wide = augmented(PRESSURE_FORM, ["leakage_coefficient"])
    leaky = parameters()
    leaky.leakage_coefficient = 1.0
    state = (*STATE, RIG.leakage_coefficient)
    assert wide.step(state, (100.0, 101.0), leaky, 1e-4) == wide.step(state, (100.0, 101.0), parameters(), 1e-4)


def test_air_softens_the_oil_and_nearly_no_air_does_not() -> None:
    wide = augmented(PRESSURE_FORM, [AIR_FRACTION])
    plain = PRESSURE_FORM.step(STATE, (100.0, 101.0), parameters(), 1e-4)
    hard, soft = (wide.step((*STATE, air), (100.0, 101.0), parameters(), 1e-4) for air in (1e-9, 5e-3))
    stiffness = [after[2] - STATE[2] for after in (plain, hard, soft)]
    assert stiffness[1] == pytest.approx(stiffness[0], rel=0.02)
    assert 0.2 < stiffness[2] / stiffness[0] < 0.9
    assert soft[3] == STATE[3]


def test_a_parameter_that_cannot_be_a_state_is_refused() -> None:
    with pytest.raises(HydrostateError, match="got 'piston_area'"):
        augmented(PRESSURE_FORM, ["piston_area"])
    with pytest.raises(HydrostateError, match="once, got 'flow_bias'"):
        augmented(PRESSURE_FORM, ["flow_bias", "flow_bias"])
    with pytest.raises(HydrostateError, match="acceleration form has none"):
        augmented(ACCELERATION_FORM, [AIR_FRACTION])


def test_a_first_guess_of_zero_begins_at_a_share_of_the_healthy_value() -> None:
    model = augmented(PRESSURE_FORM, ["leakage_coefficient"])
    base = first_belief(PRESSURE_FORM, Record(1e-3, {"position_m": np.zeros(3)}), 2e8, 1e8)
    prior = augmented_prior(model, base, replace(RIG, leakage_coefficient=0.0))
    assert prior.mean[-1] == pytest.approx(1e-3 * RIG.leakage_coefficient, abs=0.0)


def followed(names: list[str], drift: dict[str, float]) -> tuple[Estimate, EhaParameters]:
    """Filter a run whose leakage jumps fivefold after five seconds."""
    rng = np.random.default_rng(4)
    worn = replace(RIG, leakage_coefficient=5.0 * RIG.leakage_coefficient)
    path = abrupt_fault(RIG, worn, at=5.0)
    drive = make_drive("prbs", 10.0, 1e-3, RIG, rng)
    log = simulate(LUMPED, drive, 1e-3, path, sensors=BENCH, rng=rng)
    model = augmented(PRESSURE_FORM, names, drift)
    prior = augmented_prior(model, first_belief(PRESSURE_FORM, log, 2.07e8, 2e7), RIG, 0.3)
    return run_filter(ekf, model, prior, log, RIG, noise={"differential_pressure_pa": 1e5, **drift}), worn


def test_a_random_walk_follows_an_abrupt_leak() -> None:
    estimate, worn = followed(["leakage_coefficient"], {"leakage_coefficient": 0.5})
    track, _ = estimate.track("leakage_coefficient")
    before = np.median(track[(estimate.time > 3.0) & (estimate.time < 5.0)])
    after = np.median(track[estimate.time > 8.0])
    assert before == pytest.approx(RIG.leakage_coefficient, rel=0.1, abs=0.0)
    assert after == pytest.approx(worn.leakage_coefficient, rel=0.25, abs=0.0)
    assert estimate.settled(BULK_MODULUS)[0] == pytest.approx(RIG.bulk_modulus, rel=0.02)


@pytest.mark.slow
def test_states_stay_within_their_physical_bounds() -> None:
    estimate, _ = followed(list(AUGMENTABLE), dict.fromkeys(AUGMENTABLE, 1.0))
    for state in estimate.model.states:
        track, _ = estimate.track(state.name)
        assert np.all(np.isfinite(track))
        assert np.all(track >= state.lower * (1.0 - 1e-9))
        assert np.all(track <= state.upper * (1.0 + 1e-9))
