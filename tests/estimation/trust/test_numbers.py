"""Bounds, tests of innovations, gates and cards of small inputs, kept in `numbers.json`."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.filters.run import Estimate
from estimation.models.eha_forms import BULK_MODULUS, FORMS, PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.trust.bounds import at_bulk_modulus, bulk_modulus_bound, posterior_bound
from estimation.trust.card import Card, percent, rank_drives, sentences
from estimation.trust.chi_square import chi_square_quantile, chi_square_tail
from estimation.trust.consistency import consistency_gate, describes_log, mean_chi_square_bounds, nees, wander
from estimation.trust.identifiability import UNKNOWN, identifiability_card
from estimation.trust.whiteness import quantum, whiteness
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = EhaParameters()
CHANNELS = ("position_m", "velocity_m_s", "differential_pressure_pa")
SAMPLES = 1200
TIME: Array = np.linspace(0.0, 0.002 * (SAMPLES - 1), SAMPLES)


@NUMBERS.case()
def distributions() -> dict[str, Any]:
    rng = np.random.default_rng(1)
    covariances = np.array([np.eye(3) * (1.0 + i) + 0.2 for i in range(4)])
    return {
        "tail of chi-square": [
            chi_square_tail(statistic, freedom) for freedom in (1, 2, 5, 8) for statistic in (0.3, 4.0, 30.0)
        ],
        "tail at the ends": [chi_square_tail(statistic, 3) for statistic in (-1.0, 0.0, np.inf, np.nan)],
        "quantile of chi-square": [
            chi_square_quantile(p, freedom) for freedom in (1, 2, 5, 8) for p in (0.05, 0.5, 0.999)
        ],
        "band of a mean": [list(mean_chi_square_bounds(degrees, count)) for degrees, count in ((1, 10), (3, 200))],
        "wider band": list(mean_chi_square_bounds(2, 50, 0.99)),
        "NEES": nees(rng.standard_normal((4, 3)), covariances),
    }


@cache
def drive() -> Array:
    rng = np.random.default_rng(3)
    return 100.0 * np.sign(np.sin(2.0 * np.pi * 3.0 * TIME + 0.1)) + rng.standard_normal(SAMPLES)


def white() -> Array:
    return np.random.default_rng(8).standard_normal((SAMPLES, 3))


def innovations(kind: str) -> Array:
    """Return innovations over their predicted deviation."""
    wave = np.sin(2.0 * np.pi * 3.0 * TIME)[:, None]
    return {
        "white": white(),
        "with a line where the drive is": white() + np.array([0.0, 0.35, 0.0]) * wave,
        "with a line beside it": white() + np.array([0.5, 0.0, 0.0]) * np.sin(2.0 * np.pi * 21.0 * TIME)[:, None],
        "with an offset": white() + np.array([0.0, 0.0, 0.5]),
        "small and coloured": 0.05 * np.cumsum(white(), axis=0) * 0.1,
        "with gaps": np.where(np.arange(SAMPLES)[:, None] % 3 == np.array([0, 4, 1]), np.nan, white()),
        "with few samples": np.where(np.arange(SAMPLES)[:, None] % 9 > np.array([0, 9, 9]), np.nan, white()),
    }[kind]


KINDS = (
    "white",
    "with a line where the drive is",
    "with a line beside it",
    "with an offset",
    "small and coloured",
    "with gaps",
    "with few samples",
)


def record(quantised: bool = False) -> Record:
    position = np.cumsum(0.001 * drive()) * 1e-4
    pressure = 1e5 * np.sin(7.0 * TIME)
    if quantised:
        position, pressure = 2e-6 * np.round(position / 2e-6), 5e3 * np.round(pressure / 5e3)
    channels = {"position_m": position, "velocity_m_s": 1e-4 * drive(), "differential_pressure_pa": pressure}
    return Record(0.002, {"motor_speed_rad_s": drive(), **channels})


def estimate(
    mean: Array, std: Array, residuals: Array | None = None, nis: Mapping[str, float] | None = None, size: float = 1e-5
) -> Estimate:
    """Return an estimate of the pressure form with a given course of bulk modulus [Pa]."""
    means, variances = np.zeros((SAMPLES, 4)), np.ones((SAMPLES, 4))
    means[:, 3], variances[:, 3] = mean, std**2
    told = white() if residuals is None else residuals
    return Estimate(
        PRESSURE_FORM, CHANNELS, TIME, means, variances, None, nis or {}, 0.0, size * told, np.full(told.shape, size**2)
    )


@NUMBERS.case()
def innovations_that_are_tested() -> dict[str, Any]:
    calm = np.full(SAMPLES, 2e8), np.full(SAMPLES, 1e6)
    told: dict[str, Any] = {}
    for kind in KINDS:
        found = whiteness(estimate(*calm, innovations(kind)), record())
        told[kind] = {one.channel: asdict(one) | {"exceeded": one.exceeded} for one in found}
    coarse = whiteness(
        estimate(*calm, innovations("with a line where the drive is"), size=2e-6), record(quantised=True)
    )
    told["quantised"] = {one.channel: {"excess": one.excess, "crosses": one.crosses} for one in coarse}
    still = whiteness(estimate(*calm), record().replace(motor_speed_rad_s=np.zeros(SAMPLES)))
    told["still"] = {one.channel: asdict(one) for one in still}
    told["quantum"] = [quantum(np.asarray(np.round(np.sin(TIME), digits), dtype=np.float64)) for digits in (2, 6)] + [
        quantum(np.ones(5))
    ]
    return told


@NUMBERS.case()
def gates_on_either_side() -> dict[str, Any]:
    k: Array = np.linspace(0.0, SAMPLES - 1.0, SAMPLES)
    narrowing: Array = np.asarray(2e7 / np.sqrt(1.0 + 0.2 * k), dtype=np.float64)
    rng = np.random.default_rng(4)
    walk = np.cumsum(rng.standard_normal(SAMPLES))
    courses: dict[str, tuple[Array, Array]] = {
        "calm": (2e8 + 0.0 * k, narrowing),
        "wanders a little": (2e8 + 1e5 * walk, narrowing),
        "wanders almost too far": (2e8 + 2.4e5 * walk, narrowing),
        "wanders too far": (2e8 + 2.75e5 * walk, narrowing),
        "wanders": (2e8 + 6e5 * walk, narrowing),
        "drifts a little": (2e8 + 1.8e4 * k, np.full(SAMPLES, 1e5)),
        "drifts": (2e8 + 3.4e4 * k, np.full(SAMPLES, 1e5)),
        "drifts within its deviation": (2e8 + 3.4e4 * k, np.full(SAMPLES, 2e6)),
        "at its lower bound": (np.full(SAMPLES, 9e4), np.full(SAMPLES, 1e4)),
        "just above it": (np.full(SAMPLES, 1.1e5), np.full(SAMPLES, 1e4)),
        "at its upper bound": (np.full(SAMPLES, 1.9985e10), np.full(SAMPLES, 1e4)),
        "just below it": (np.full(SAMPLES, 1.9975e10), np.full(SAMPLES, 1e4)),
    }
    told = {name: _of_gate(estimate(*course)) for name, course in courses.items()}
    for nis in (1.9, 2.1, 99.0, 101.0):
        told[f"NIS of {nis:g}"] = _of_gate(estimate(*courses["calm"], nis={"position_m": 1.0, "velocity_m_s": nis}))
    for kind in KINDS[1:4]:
        told[f"innovations {kind}"] = _of_gate(estimate(*courses["calm"], innovations(kind)), record())
    return told


def _of_gate(found: Estimate, log: Record | None = None) -> dict[str, Any]:
    gate = consistency_gate(found, BULK_MODULUS, log)
    return {
        "passed": gate.passed,
        "reasons": {str(one.code): dict(one.data) for one in gate.reasons},
        "stretched by": gate.inflation,
        "wander": wander(found, BULK_MODULUS),
        "describes": describes_log(found, BULK_MODULUS),
    }


@cache
def steps() -> Array:
    return make_drive("steps", 0.3, 1e-3, PAPER, np.random.default_rng(2))


VARIANCES = {"position_m": 1e-12, "velocity_m_s": 1e-6, "differential_pressure_pa": 4e8}


@NUMBERS.case()
def bounds_of_cramer_and_rao() -> dict[str, Any]:
    log = Record(1e-3, {"motor_speed_rad_s": steps()}, start_time=2.0)
    told: dict[str, Any] = {}
    for form in ("pressure", "acceleration"):
        model = FORMS[form]
        third = 1e3 if form == "pressure" else 1.0
        prior = Gaussian(np.array([0.0, 0.0, 0.0, 1.8e8]), np.diag([1e-10, 1e-8, third**2, 1.6e15]))
        known = {name: VARIANCES[name] for name in CHANNELS[: 3 if form == "pressure" else 2]}
        bound = posterior_bound(model, prior, log, PAPER, variances=known)
        told[form] = {
            "mean": bound.mean[[10, 150, 299]],
            "deviations": [bound.std[[10, 150, 299], i] for i in range(model.width)],
            "of bulk modulus [Pa]": bound.track(BULK_MODULUS)[[0, 50, 299]],
            "time [s]": bound.time[[0, 299]],
            "belief": None if bound.belief is None else [bound.belief.covariance[i, 3] for i in range(4)],
            "of the rig's modulus [Pa]": bulk_modulus_bound(
                model, prior, log, PAPER, channels=("position_m",), variances=VARIANCES
            ),
            "with more noise [Pa]": bulk_modulus_bound(
                model,
                prior,
                log,
                PAPER,
                channels=("position_m",),
                variances=VARIANCES,
                noise={model.states[2].name: 1e12},
            ),
        }
    slow = Record(5e-3, {"motor_speed_rad_s": steps()[::5]})
    prior = Gaussian(np.array([0.0, 0.0, 0.0, 2.07e8]), np.diag([1e-10, 1e-8, 1e6, 1.6e15]))
    told["at 200 Hz [Pa]"] = bulk_modulus_bound(
        PRESSURE_FORM, prior, slow, PAPER, channels=("position_m",), variances=VARIANCES
    )
    told["at another modulus"] = asdict(at_bulk_modulus(PAPER, 3e8))
    return told


@cache
def card(channels: tuple[str, ...] = CHANNELS, uncertain: bool = False, weak: bool = False) -> Card:
    speed = 0.02 * steps() if weak else steps()
    return identifiability_card(
        PAPER, speed, 1e-3, channels, uncertainties={"chamber_volume": 0.1, "moving_mass": 0.05} if uncertain else None
    )


CARDS = {
    "all channels": (CHANNELS, False, False),
    "position, uncertain rig": (CHANNELS[:1], True, False),
    "a piston that sticks": (CHANNELS[:1], False, True),
    "sticks, with pressure": (CHANNELS, True, True),
}


@NUMBERS.case(relative=1e-5)
def cards() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, which in CARDS.items():
        found = card(*which)
        told[name] = {
            "relative deviation": dict(found.relative_std),
            "with all else known": dict(found.known_exactly),
            "correlation with bulk modulus": found.correlation[0],
            "deviation of the friction force": found.friction_force,
            "share of time that it sticks": found.stuck,
            "deviation of what is known worst": found.weakest_std,
            "what is known worst": [abs(weight) for weight in found.weakest.values()],
            "uncertainties": dict(found.uncertainties),
            "overall": found.overall,
        }
    one = identifiability_card(
        replace(PAPER, friction_linear=-50.0), steps(), 1e-3, unknowns=UNKNOWN[:2], uncertainties={"flow_bias": 0.2}
    )
    told["two unknowns"] = {
        "relative deviation": dict(one.relative_std),
        "deviation of the friction force": one.friction_force,
    }
    told["order of drives"] = [
        rank_drives({name: card(*which) for name, which in CARDS.items()}, by) for by in (None, "friction_coulomb")
    ]
    return told


@NUMBERS.case()
def what_cards_say() -> dict[str, Any]:
    def made(
        unknowns: tuple[str, ...],
        std: tuple[float, ...],
        correlation: float,
        stuck: float,
        channels: tuple[str, ...],
        **spreads: float,
    ) -> Card:
        count = len(unknowns)
        matrix = np.full((count, count), correlation) + (1.0 - correlation) * np.eye(count)
        weights = dict(zip(unknowns, np.linspace(1.0, 0.1, count), strict=True))
        known = {name: 0.5 * one for name, one in zip(unknowns, std, strict=True)}
        return Card(
            channels,
            unknowns,
            dict(zip(unknowns, std, strict=True)),
            known,
            matrix,
            0.1,
            weights,
            max(std),
            stuck,
            spreads,
        )

    return {
        "well known": sentences(made(UNKNOWN[:3], (0.01, 0.029, 0.002), 0.5, 0.1, CHANNELS)),
        "badly known": sentences(made(UNKNOWN[:3], (0.031, 0.5, 0.995), 0.94, 0.51, CHANNELS[:1], chamber_volume=0.1)),
        "alike": sentences(made(UNKNOWN[:4], (0.004, 0.02, 0.05, 0.002), 0.96, 0.6, CHANNELS, moving_mass=0.05)),
        "alike but known": sentences(made(UNKNOWN[:2], (0.0029, 0.002), 0.99, 0.0, CHANNELS)),
        "other unknowns": sentences(made(UNKNOWN[1:3], (0.4, 0.02), 0.9, 0.0, CHANNELS)),
        "per cents": [percent(value) for value in (1e-3, 0.0314, 0.985, 0.99, 0.999, 1.0, 3.21)],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
