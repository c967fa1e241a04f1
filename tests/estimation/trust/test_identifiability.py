"""The card predicts before the experiment what the fit finds after it."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.trust.card import Card, percent, rank_drives, sentences
from estimation.trust.identifiability import CARD_CHANNELS, identifiability_card
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.sensors.sensors import BENCH, PAPER
from tests.estimation.tuning.likelihood_fit import fit_likelihood
from tests.thinned import thinned

RIG = EhaParameters()
MOTION = CARD_CHANNELS[:2]
EVERY_CONDITION = pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)


def speed(drive: str, parameters: EhaParameters = RIG, duration: float = 10.0) -> Array:
    return make_drive(drive, duration, 1e-3, parameters, np.random.default_rng(0))


@pytest.fixture(scope="module")
def steps() -> Card:
    return identifiability_card(RIG, speed("steps"), 1e-3)


@pytest.fixture(scope="module")
def sine() -> Card:
    return identifiability_card(RIG, speed("sine"), 1e-3, MOTION)


@pytest.mark.slow
@EVERY_CONDITION
def test_bulk_modulus_is_not_observable_from_the_papers_sine_without_pressure(condition: Condition) -> None:
    parameters = parameters_for(condition)
    card = identifiability_card(parameters, speed("sine", parameters), 1e-3, MOTION)
    assert card.relative_std["bulk_modulus"] > 0.03  # errata E13
    assert card.stuck > 0.5
    said = " ".join(sentences(card))
    assert "not observable with this drive and these sensors (bound over 3 %): bulk modulus" in said
    assert "while it sticks, position and velocity say nothing about bulk modulus (errata E13): log diff" in said


def test_a_stuck_piston_leaves_every_deviation_at_its_prior() -> None:
    parameters = parameters_for(CONDITIONS["major_leakage"])
    card = identifiability_card(parameters, speed("sine", parameters), 1e-3, MOTION)
    assert card.stuck == 1.0
    assert all(std == pytest.approx(1.0, rel=1e-3) for std in card.relative_std.values())


def test_logging_pressure_lowers_deviations_at_least_twentyfold(sine: Card) -> None:
    logged = identifiability_card(RIG, speed("sine"), 1e-3)
    for name in ("bulk_modulus", "leakage_coefficient", "friction_coulomb"):
        assert logged.relative_std[name] < 0.05 * sine.relative_std[name]
    assert logged.friction_force < 2e-3 < 0.05 < sine.friction_force


@pytest.mark.parametrize("name", thinned(CONDITIONS, ["normal", "minor_leakage_minor_friction", "major_friction"]))
def test_a_further_sensor_or_a_longer_log_never_raises_a_deviation(name: str) -> None:
    parameters = parameters_for(CONDITIONS[name])
    long, short = speed("steps", parameters), speed("steps", parameters)[:4000]
    whole = identifiability_card(parameters, long, 1e-3).relative_std
    for poorer in (
        identifiability_card(parameters, long, 1e-3, MOTION),
        identifiability_card(parameters, long, 1e-3, ["position_m"]),
        identifiability_card(parameters, short, 1e-3),
    ):
        assert all(whole[one] <= std * (1.0 + 1e-6) for one, std in poorer.relative_std.items())


def test_the_uncertainty_of_chamber_volume_adds_to_that_of_bulk_modulus_only(steps: Card) -> None:
    card = identifiability_card(RIG, speed("steps"), 1e-3, uncertainties={"chamber_volume": 0.02})
    expected = (steps.relative_std["bulk_modulus"] ** 2 + 0.02**2) ** 0.5
    assert card.relative_std["bulk_modulus"] == pytest.approx(expected, rel=1e-3)
    assert card.known_exactly["bulk_modulus"] == pytest.approx(steps.relative_std["bulk_modulus"], rel=1e-9)
    assert card.relative_std["friction_coulomb"] == pytest.approx(steps.relative_std["friction_coulomb"], rel=1e-3)
    assert "(chamber volume 2 %) its bound is 2 %, without" in " ".join(sentences(card))
    assert "these bounds take the volume as exact" in " ".join(sentences(steps))


def test_uncertainty_of_displacement_widens_the_flow_bias_more_than_the_friction(steps: Card) -> None:
    card = identifiability_card(RIG, speed("steps"), 1e-3, uncertainties={"pump_displacement": 0.01})
    widened = {name: std / steps.relative_std[name] for name, std in card.relative_std.items()}
    assert widened["flow_bias"] > 1.5
    assert widened["flow_bias"] > widened["friction_coulomb"]


def test_parameters_that_the_drive_cannot_separate_are_named() -> None:
    card = identifiability_card(RIG, speed("prbs"), 1e-3)
    i, j = card.unknowns.index("leakage_coefficient"), card.unknowns.index("flow_bias")
    assert card.correlation[i, j] < -0.95
    assert "leakage coefficient and flow bias are hard to tell apart (correlation -" in " ".join(sentences(card))


def test_bulk_modulus_as_the_only_unknown_has_a_smaller_deviation(steps: Card) -> None:
    card = identifiability_card(RIG, speed("steps"), 1e-3, unknowns=["bulk_modulus"])
    assert card.relative_std["bulk_modulus"] < steps.relative_std["bulk_modulus"]
    assert card.friction_force == 0.0


def test_noisier_sensors_raise_every_deviation(steps: Card) -> None:
    noisy = replace(BENCH, speed_noise=0.5, pressure_noise=5e4)
    card = identifiability_card(RIG, speed("steps"), 1e-3, sensors=noisy)
    assert all(card.relative_std[name] > std for name, std in steps.relative_std.items())


def test_drives_are_ranked_by_their_information(steps: Card, sine: Card) -> None:
    cards = {"sine": sine, "steps": steps}
    assert rank_drives(cards) == ["steps", "sine"]
    assert rank_drives(cards, "bulk_modulus") == ["steps", "sine"]
    assert steps.overall < sine.overall


@pytest.mark.slow
def test_the_deviations_of_a_fit_agree_with_the_card(steps: Card) -> None:
    rng = np.random.default_rng(0)
    sensors = replace(BENCH, position_noise=1e-6 / 12**0.5, position_quantum=0.0)
    record = simulate(LUMPED, speed("steps"), 1e-3, RIG, sensors=sensors, rng=rng)
    fit = fit_likelihood(record, RIG)
    sizes = {name: abs(value) for name, (value, _) in fit.parameters.items()}
    for name, bound in steps.relative_std.items():
        assert fit.parameters[name][1] / sizes[name] == pytest.approx(bound, rel=0.4), name


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"channels": []}, "a channel is needed"),
        ({"channels": ["pressure_a_pa"]}, "a channel must be one of position_m"),
        ({"channels": ["position_m", "position_m"]}, "once, got 'position_m'"),
        ({"unknowns": ["stroke"]}, "an unknown must be one of bulk_modulus, .* got 'stroke'"),
        ({"sensors": PAPER}, "these sensors give differential_pressure_pa no noise"),
    ],
)
def test_invalid_channels_unknowns_and_sensors_of_a_card_are_refused(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        identifiability_card(RIG, np.zeros(10), 1e-3, **wrong)


def test_a_card_relative_to_zero_leakage_is_refused() -> None:
    with pytest.raises(HydrostateError, match="a card tells leakage_coefficient relative to its value"):
        identifiability_card(replace(RIG, leakage_coefficient=0.0), np.zeros(10), 1e-3)


def test_percentages_below_100_never_round_to_100() -> None:
    assert [percent(value) for value in (1e-5, 0.0304, 0.994, 1.0)] == ["0.001 %", "3 %", "over 99 %", "100 %"]


def card(**changes: object) -> Card:
    values: dict[str, object] = {
        "channels": ("position_m",),
        "unknowns": ("bulk_modulus", "flow_bias"),
        "relative_std": {"bulk_modulus": 0.11, "flow_bias": 0.02},
        "known_exactly": {"bulk_modulus": 0.10, "flow_bias": 0.02},
        "correlation": np.array([[1.0, 0.96], [0.96, 1.0]]),
        "friction_force": 0.01,
        "weakest": {"bulk_modulus": 0.98, "flow_bias": 0.19},
        "weakest_std": 0.2,
        "stuck": 0.6,
        "uncertainties": {"chamber_volume": 0.02},
    }
    return Card(**(values | changes))  # type: ignore[arg-type]


def test_the_sentences_of_a_card_hold_its_numbers() -> None:
    lost, sticks, alike, worst, rig = sentences(card())
    assert lost.endswith("(bound over 3 %): bulk modulus (11 %)")
    assert sticks.startswith("the piston sticks for 60 % of the time")
    assert sticks.endswith("log differential pressure, or drive with larger, slower steps")
    assert "flow bias would be known to 0.56 %, not 2 %" in alike
    assert worst == "the combination known worst, to 20 %: +0.98 bulk modulus (of logarithms)"
    assert rig.endswith("(chamber volume 2 %) its bound is 11 %, without 10 %")
    with_pressure = card(channels=("position_m", "differential_pressure_pa"))
    assert sentences(with_pressure)[1].endswith("differential pressure does")


def test_a_card_without_weaknesses_has_no_sentences_about_them() -> None:
    small = {"bulk_modulus": 0.002, "flow_bias": 0.001}
    quiet = card(relative_std=small, stuck=0.5, weakest_std=0.03, correlation=np.eye(2), uncertainties={})
    (rule,) = sentences(quiet)
    assert "these bounds take the volume as exact" in rule
    assert sentences(card(relative_std=small, stuck=0.0, weakest_std=0.0)) == sentences(
        card(relative_std=small, stuck=0.0, weakest_std=0.0, correlation=np.eye(2))
    )
    alone = card(
        unknowns=("flow_bias",), relative_std={"flow_bias": 0.01}, stuck=0.0, correlation=np.eye(1), weakest_std=0.5
    )
    assert sentences(alone) == ()


def test_a_drive_under_which_the_plant_diverges_is_refused() -> None:
    with np.errstate(all="ignore"), pytest.raises(HydrostateError, match="does not stay finite under this drive"):
        identifiability_card(RIG, np.full(50, 1e300), 1e-3)
