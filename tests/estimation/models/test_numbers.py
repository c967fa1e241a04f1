"""Rates, steps and beliefs of every model on each side of its case distinctions, kept in `numbers.json`."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.models import chambers, completed_flow, eha_forms, flow, inner_circuit, motion, wide_flow
from estimation.models.aerated_oil import present_air, tangent_stiffness
from estimation.models.augment import AUGMENTABLE, augmented, augmented_prior
from estimation.models.flow_parameters import FlowParameters, flow_parameters
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.compiled.expression import symbol
from plant.eha.model import EhaParameters
from tests.kernels import computed
from tests.numbers import Numbers, refused

NUMBERS = Numbers(__file__)
PAPER = EhaParameters()
SPEEDS = {"forward": (90.0, 96.0), "backward": (-90.0, -84.0), "turning": (-1.0, 3.0), "at rest": (0.0, 0.0)}


def namespace(p: Any, **changes: float) -> SimpleNamespace:
    return SimpleNamespace(**{**asdict(p), **changes})


ROD = namespace(
    FlowParameters(),
    makeup_conductance=2e-9,
    makeup_opening=2e3,
    case_leakage=3e-13,
    speed_lead=2e-4,
    accumulator_stiffness=4e9,
    crack_a=3e3,
    crack_b=1e3,
    area_difference=0.2,
    volume_difference=0.1,
    pilot_share=0.4,
    flow_bias=2e-6,
    bulk_modulus=3e8,
)
PRESSURES = {
    "A high": (3e6, 4e5),
    "B high": (5e5, 2.5e6),
    "A starved": (2e5, 1e6),
    "B starved": (9e5, 1.5e5),
    "relieving": (6e6, 5e5),
    "relieving backward": (5e5, 6e6),
    "alike": (1e6, 1e6),
}


@NUMBERS.case()
def flow_forms() -> dict[str, Any]:
    told: dict[str, Any] = {}
    forms = {
        "by volume": flow.FLOW_FORM,
        "by mass": flow.MASS_FLOW_FORM,
        "held": flow.HELD_FLOW_FORM,
        "completed": completed_flow.completed_flow_form(flow.FLOW_FORM),
        "completed by mass": completed_flow.completed_flow_form(flow.MASS_FLOW_FORM),
        "relieving": flow.form_with_relief(flow.FLOW_FORM),
    }
    for name, form in forms.items():
        told[name] = {
            "unknowns": list(form.unknowns),
            "sizes": dict(form.linear),
            "jump": list(form.jump),
            "at rest [Pa]": list(form.initial(ROD)),
            "name": form.name,
            "differential [Pa]": list(form.observe((3e6, 1e6, 5e5))),
        }
        for where, pressures in PRESSURES.items():
            state = (*pressures, 4.4e5)[: len(form.initial(ROD))]
            for how, speeds in SPEEDS.items():
                drives = (speeds, (0.01, 0.0103), 2e-3)
                told[name][f"{where}, {how}"] = list(form.rates(state, drives, ROD, 0.25))
    told["ports"] = [
        flow.port_flows(pumped, leaked, dp, (0.01, 0.01))
        for pumped in (-1e-5, 0.0, 1e-5)
        for leaked, dp in ((2e-6, 1e6), (-2e-6, -1e6), (0.0, 0.0), (1e-6, 0.5))
    ]
    seat = (ROD.accumulator_pressure - 2.0, ROD.accumulator_pressure + 0.5)
    told["at their seats"] = [
        inner_circuit.inner_flows(seat, ROD),
        inner_circuit.inner_flows(seat[::-1], ROD, (1.0, 0.0)),
        flow.chamber_rates(seat, flow.Delivery(0.0, 0.0, 0.0), ROD, by_mass=False),
    ]
    told["leaks"] = [flow.leaked_flow(dp, 1e-12, ROD) for dp in (-6e6, -1e6, 0.0, 3.4e6, 3.5e6)]
    told["relief"] = [
        flow.reaches_relief(np.array([np.nan, part, 0.0]), 1e6) for part in (0.969e6, 0.971e6, -0.969e6, -0.971e6)
    ]
    told["parameters"] = asdict(flow_parameters(PAPER))
    form = flow.FLOW_FORM
    values = dict.fromkeys(form.unknowns, 2e-5)
    told["coordinates"] = [form.theta(values), form.values(np.linspace(-1.0, 1.0, 7))]
    return told


WIDE: dict[str, dict[str, float]] = {
    "plain": {},
    "offset and drift": {"pressure_offset": 3e4, "pressure_drift": 2e4, "pressure_lag": 1e-3},
    "late sensors": {"speed_lag": 2e-3, "position_lag": 1e-3, "position_play": 2e-4, "position_zero": 0.01},
    "play crossed by pressure": {"position_play": 2e-4, "play_by_pressure": 0.7},
    "play crossed at once": {"position_play": 2e-4, "play_at_once": 0.6},
    "play sprung back": {"position_play": 2e-4, "play_by_pressure": -1.5, "play_sprung": 0.9},
    "air": {"air_softness": 300.0},
    "much air": {"air_softness": 3e9},
    "air that gets in": {"air_softness": 300.0, "air_onset": 0.39},
    "air that is in": {"air_softness": 300.0, "air_onset": 0.3},
    "air that gets in later": {"air_softness": 300.0, "air_onset": 0.5},
    "air from the beginning": {"air_softness": 300.0, "air_onset": 0.0},
    "growing": {"leakage_growth": 0.8, "leakage_bend": 0.5},
    "rising": {"leakage_rise": 1.5},
    "stepping": {"leakage_before": -0.8, "step_at": 0.4, "step_width": 0.05},
    "shrinking to nothing": {"leakage_growth": 40.0},
    "valves that open apart": {"crack_pressure": 2e4, "crack_difference": 9e3},
    "other valves": {"crack_pressure": 2e3, "makeup_share_b": 0.5, "drain_share_a": 0.7, "drain_share_b": 1.4},
    "by mass": {"by_mass": 1.0},
}


@NUMBERS.case()
def wide_flow_form() -> dict[str, Any]:
    told: dict[str, Any] = {}
    base = asdict(wide_flow.WideFlowParameters()) | vars(ROD)
    courses = ((1.0, 0.8), (0.2, -0.5), (-0.3, -0.1), (0.0, -1.5))
    drives = ((90.0, 96.0), (0.01, 0.0103), (0.4, 0.402), (0.14, 0.15), *courses, 2e-3)
    for name, changes in WIDE.items():
        p = SimpleNamespace(**{**base, **changes})
        told[name] = {
            where: list(wide_flow.WIDE_FLOW_FORM.rates((*pressures, 1e4, 4.4e5), drives, p, 0.25))
            for where, pressures in {**PRESSURES, "short": (5e3, 1e6), "void": (5e2, 1e6)}.items()
        }
        told[name]["stiffness [Pa]"] = [tangent_stiffness(one, present_air(0.4, p), p) for one in (2e2, 1e3, 2e4, 1e6)]
    for name in ("air", "air that is in"):
        p = SimpleNamespace(**{**base, **WIDE[name], "air_quickness": 0.2, "by_mass": 1.0})
        told[f"{name}, squeezed quickly"] = {
            where: list(wide_flow.QUICK_FLOW_FORM.rates((*pressures, 1e4, 4.4e5), drives, p, 0.25))
            for where, pressures in PRESSURES.items()
        }
    told["growth"] = [
        wide_flow.grown_leakage(elapsed, *changes)
        for elapsed in (0.0, 0.5, 0.9)
        for changes in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 2.0), (4.0, 0.0, 0.0))
    ]
    held = SimpleNamespace(**{**base, "start_pressure": -2e5, "start_level": 3e4, "pressure_offset": 1e4})
    told["at rest"] = list(wide_flow.WIDE_FLOW_FORM.initial(held))
    told["sizes"] = dict(wide_flow.LINEAR)
    told["absent"] = asdict(wide_flow.WideFlowParameters())
    return told


@NUMBERS.case()
def motion_forms() -> dict[str, Any]:
    told: dict[str, Any] = {}
    bristle = {"bristle_stiffness": 2e7, "bristle_damping": 150.0}
    p = SimpleNamespace(**{**asdict(motion.MotionParameters()), **vars(ROD), **bristle})
    del p.makeup_opening  # the form sets its own
    falling = SimpleNamespace(**{**vars(p), "friction_linear": -5e3, "load_force": -4e3})
    for form in motion.MOTION_FORMS:
        for name, one in (("rising", p), ("falling", falling)):
            told[f"{form.name}, {name}"] = {
                "at rest": list(form.initial(one)),
                "rates": [
                    list(
                        form.rates((0.01, velocity, bristle, 2e6, 6e5), ((90.0, 96.0), (0.01, 0.0103), 2e-3), one, 0.25)
                    )
                    for velocity in (-0.05, 0.0, 0.03)
                    for bristle in (-0.9, 0.4)
                ],
            }
        told[form.name] = {"unknowns": list(form.unknowns), "sizes": dict(form.linear)}
    for name, friction in (("lagging", motion.lagging_friction), ("parallel", motion.parallel_friction)):
        told[f"{name} friction"] = [
            list(friction(velocity, 0.6, one)) for velocity in (-0.04, 0.0, 0.02) for one in (p, falling)
        ]
    told["parameters"] = asdict(motion.MotionParameters())
    return told


def stepped(model: ProcessModel, state: Mapping[str, float], drives: Any, p: Any, h: float) -> list[float]:
    """Return the result of a model's step for given numbers, computed from its expressions."""
    names = [f"x{i}" for i in range(model.width)]
    moved = model.step(tuple(symbol(name) for name in names), drives, p, h)
    found = computed({f"y{i}": one for i, one in enumerate(moved)}, **dict(zip(names, state.values(), strict=True)))
    return list(found.values())


def begun(model: ProcessModel, a: float, b: float) -> dict[str, float]:
    state = {one.name: (1.3 if one.logarithmic else 0.7) * one.scale for one in model.states}
    return state | {"pressure_a_pa": a, "pressure_b_pa": b}


@NUMBERS.case()
def chamber_filters() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for model in (chambers.CHAMBERS, chambers.CHAMBERS_BY_MASS, chambers.CHAMBERS_HELD):
        told[model.name] = {
            "longest step [s]": model.longest_step,
            **{
                where: stepped(model, begun(model, *pressures), ((90.0, 96.0), (0.01, 0.0103)), ROD, 2e-4)
                for where, pressures in PRESSURES.items()
            },
        }
    told["states"] = {
        one.name: [one.scale, one.noise_density, one.lower, one.upper, *one.scaled_bounds] for one in chambers.STATES
    }
    told["observed"] = dict(chambers.observe_chambers((3e6, 1e6), ROD))
    for name, load, given in (
        ("A loaded", 2e6, {}),
        ("B loaded", -1e6, {"leakage": 3.0, "bias": 0.5, "makeup": 2e-9}),
        ("at rest", 0.0, {}),
    ):
        for which, p in (("paper", PAPER), ("tight", replace(PAPER, leakage_coefficient=0.0, flow_bias=0.0))):
            belief = chambers.chamber_belief(p, load, 2e8, **given)
            told[f"{name}, {which}"] = [belief.mean, belief.std]
    return told


@NUMBERS.case()
def process_forms() -> dict[str, Any]:
    told: dict[str, Any] = {}
    models = (eha_forms.ACCELERATION_FORM, eha_forms.PRINTED_FORM, eha_forms.PRESSURE_FORM)
    for model in models:
        third = 2.0 if "acceleration" in model.name else 1.5e6
        told[model.name] = [
            list(model.step((0.01, velocity, third, 2.1e8), speeds, namespace(PAPER, bulk_modulus=1e8), 5e-5))
            for velocity in (-0.02, 0.0, 0.03)
            for speeds in SPEEDS.values()
        ]
        told[f"{model.name}, states"] = {
            one.name: [one.scale, one.noise_density, one.lower, one.upper] for one in model.states
        }
        told[f"{model.name}, observed"] = dict(model.observe((0.01, 0.02, 2e6, 2e8), PAPER))
        told[f"{model.name}, steps"] = [model.substeps(t) for t in (5e-5, 1e-4, 1.5e-4, 1e-3)]
    unknown = {"motor_speed_rad_s": np.array([1.0, 4.0]), "position_m": np.array([1e-8, 0.0])}
    variance, slopes = eha_forms.undetermined_volume(PAPER, unknown, 2e-3)
    told["left open"] = [variance, dict(slopes)]
    model = chambers.CHAMBERS
    belief = chambers.chamber_belief(PAPER, 1e6, 2e8)
    inside = model.to_filter(belief)
    told["in the filter"] = [inside.mean, inside.std]
    told["and back"] = [*model.to_si(inside.mean)]
    told["noise"] = [model.noise_units, model.noise_densities({"flow_bias": 2.0, "pressure_a_pa": 3e10})]
    mean = belief.mean.copy()
    mean[2] = 0.0
    told["refused"] = [
        refused(lambda: model.to_filter(Gaussian(mean, belief.covariance))),
        refused(lambda: model.require_drives(["position_m"])),
        refused(lambda: Gaussian(np.zeros(2), np.eye(3))),
        refused(lambda: Gaussian(np.zeros((2, 2)), np.eye(2))),
        refused(lambda: Gaussian(np.array([np.nan]), np.eye(1))),
        refused(lambda: Gaussian(np.zeros(1), np.array([[np.inf]]))),
        refused(lambda: Gaussian(np.zeros(1), np.array([[-1.0]]))),
        refused(lambda: Gaussian(np.zeros(1), np.array([[0.0]]))),
    ]
    return told


@NUMBERS.case()
def further_states() -> dict[str, Any]:
    told: dict[str, Any] = {}
    base = eha_forms.PRESSURE_FORM
    every = augmented(base, AUGMENTABLE, {"leakage_coefficient": 0.2})
    told["states"] = {
        one.name: [one.scale, one.noise_density, one.lower, one.upper, one.logarithmic] for one in every.states
    }
    told["name"] = every.name
    healthy = namespace(PAPER)
    for name, names in {
        "none": (),
        "leakage": ("leakage_coefficient",),
        "air": ("air_fraction",),
        "all": AUGMENTABLE,
    }.items():
        model = augmented(base, names)
        values = {one.name: 1.2 * one.scale for one in model.states[4:]}
        for pressure in (-2e6, 0.0, 3e6):
            state = {"x": 0.01, "v": 0.02, "dp": pressure, "beta": 1.9e8, **values}
            told[f"{name}, {pressure:g} Pa"] = stepped(model, state, (90.0, 96.0), healthy, 1e-4)
        told[f"{name}, observed"] = dict(model.observe((0.01, 0.02, 1e6, 2e8, *values.values()), healthy))
    prior = Gaussian(np.array([0.0, 0.0, 0.0, 2e8]), np.diag([1e-10, 1e-8, 1e6, 1.6e15]))
    for name, p, spread in (
        ("paper", PAPER, 1.5),
        ("less", PAPER, {"leakage_coefficient": 0.2}),
        ("tight", replace(PAPER, leakage_coefficient=0.0, friction_linear=-20.0), 0.5),
    ):
        belief = augmented_prior(every, prior, p, spread)
        told[f"prior, {name}"] = [belief.mean, belief.std]
    told["refused"] = [
        refused(lambda: augmented(base, ["other"])),
        refused(lambda: augmented(base, ["flow_bias", "flow_bias"])),
        refused(lambda: augmented(eha_forms.ACCELERATION_FORM, ["air_fraction"])),
        refused(lambda: augmented(eha_forms.ACCELERATION_FORM, ["flow_bias"])),
    ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
