"""Results of the diaphragm-motor paper's own models, kept in `numbers.json`."""

from typing import Any

import numpy as np
import pytest

from plant.motor_paper.fractional import (
    caputo_from_rest,
    fractional_history,
    fractional_push,
    gl_weights,
    grunwald_letnikov,
    oustaloup_states,
)
from plant.motor_paper.hysteresis_model import (
    HysteresisParameters,
    describing_function,
    harmonics,
    hysteresis_loop,
    linearised,
    loop_area,
    total_harmonic_distortion,
)
from plant.motor_paper.loop_blocks import (
    Pid,
    PidMemory,
    band_limited_noise,
    pid_step,
    relay,
    run_loop,
    ultimate_point,
)
from plant.motor_paper.vibration_model import (
    VibrationParameters,
    exact_response,
    first_mode,
    massless_matrices,
    mechanical_matrices,
    reduced_stiffness,
    state_space,
    with_fractional_damping,
)
from plant.motor_paper.vibration_run import forced_vibration, vibration_run
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
PAPER = VibrationParameters()
VARIED = VibrationParameters(
    diaphragm_stiffness=1e6,
    load_stiffness=3e4,
    cubic_stiffness=4e11,
    damping=12.0,
    fractional_damping=900.0,
    fractional_order=0.7,
)
FAST = VibrationParameters(fractional_damping=3.0, fractional_order=1.3)


@NUMBERS.case()
def vibration() -> dict[str, Any]:
    told: dict[str, Any] = {"fields": dict(vars(PAPER))}
    for name, p in {"paper": PAPER, "varied": VARIED, "fast": FAST}.items():
        wide = with_fractional_damping(massless_matrices(p), p)
        told[name] = {
            "natural frequency [Hz]": p.natural_frequency,
            "stiffness [N/m]": [reduced_stiffness(p, law) for law in ("mended", "printed", "printed_1_to_3")],  # type: ignore[arg-type]
            "mended": [one.tolist() for one in mechanical_matrices(p)],
            "printed": mechanical_matrices(p, "printed")[0],
            "massless": [one.tolist() for one in massless_matrices(p)],
            "response [m/N]": exact_response(p, np.array([50.0, 480.0, 900.0, 4e3])),
            "with fractional damping": [
                wide[0].shape[0],
                wide[0].sum(axis=0)[:3],
                wide[0].sum(axis=1)[:4],
                wide[1].T,
                wide[2],
            ],
            "first mode [rad/s]": first_mode(np.linalg.eigvals(wide[0])),
            "state space": state_space(p, massless=True)(2j * np.pi * 300.0),
            "state space, both masses": state_space(p)(2j * np.pi * 300.0),
        }
    told["printed, in time"] = state_space(PAPER, signs="printed")(2j * np.pi * 300.0)
    told["real poles"] = or_refused(lambda: first_mode(np.array([-1.0 + 0j, -2.0 + 0j])))
    told["an oscillation from"] = edge(
        lambda one: or_refused(lambda: abs(first_mode(np.array([-1.0 + 1j * one])))).__class__, 1e-8, 1e-4
    )
    told["order to"] = edge(
        lambda one: or_refused(lambda: VibrationParameters(fractional_order=one).damping).__class__, 1.0, 3.0
    )
    return told


@NUMBERS.case()
def fractional_derivatives() -> dict[str, Any]:
    time = 1e-2 * np.arange(30.0)
    wave = np.sin(9.0 * time) + 0.2
    weights, ring, newest, sums = gl_weights(0.6, 5), np.zeros(8), 0, []
    for sample in wave[:11]:
        sums.append(fractional_history(weights, ring, newest))
        newest = fractional_push(ring, newest, float(sample))
    states = {order: oustaloup_states(order, 2.0, 5e3, 3) for order in (0.0, 0.4, 1.0, 1.5)}
    return {
        "weights": [gl_weights(order, 6) for order in (0.5, 1.0, 1.7, -0.5)],
        "sums over a ring": sums,
        "ring": ring,
        "newest": newest,
        "derivatives": [grunwald_letnikov(wave, order, 1e-2)[[0, 1, 10, 29]] for order in (0.5, 1.4, -0.7)],
        "of a short memory": grunwald_letnikov(wave, 0.5, 1e-2, 4)[[0, 3, 4, 29]],
        "Caputo's": caputo_from_rest(wave, 0.5, 1e-2, 9)[[0, 3, 9, 29]],
        "states": {
            str(order): {
                "poles [1/s]": np.diag(one.A),
                "B": one.B,
                "C": one.C,
                "D": one.D,
                "on velocity": one.on_velocity,
                "response": one.response(np.array([0.5, 30.0, 2e4])),
            }
            for order, one in states.items()
        },
        "five states": len(oustaloup_states(0.5, 1.0, 1e3).B),
        "orders that are refused": [
            isinstance(or_refused(lambda order=order: grunwald_letnikov(wave, order, 1.0)), str)
            for order in (-2.1, -2.0, 2.0, 2.1)
        ],
        "orders of damping": [
            isinstance(or_refused(lambda order=order: caputo_from_rest(wave, order, 1.0)), str)
            for order in (-0.1, 0.0, 2.0, 2.1)
        ],
        "orders of states": [
            isinstance(or_refused(lambda order=order: oustaloup_states(order, 1.0, 9.0).D), str)
            for order in (-0.1, 0.0, 1.9, 2.0)
        ],
        "bands": [
            isinstance(or_refused(lambda band=band: oustaloup_states(0.5, *band).D), str)
            for band in ((0.0, 1.0), (1.0, 1.0), (1.0, 2.0, 0), (1.0, 2.0, 1), (0.5, 0.9))
        ],
        "memories": [
            isinstance(or_refused(lambda one=one: grunwald_letnikov(wave, 0.5, 1.0, one)), str) for one in (1, 2)
        ],
    }


@NUMBERS.case()
def hysteresis() -> dict[str, Any]:
    told: dict[str, Any] = {"fields": dict(vars(HysteresisParameters()))}
    for name, p in {
        "paper": HysteresisParameters(),
        "varied": HysteresisParameters(exponent=1.4, alpha=0.2, beta=0.003),
    }.items():
        for law in ("mended", "printed"):
            voltage, h = hysteresis_loop(p, 80.0, 480.0, 60, law)  # type: ignore[arg-type]
            told[f"{name}, {law}"] = {
                "voltage [V]": voltage[[0, 7, 30, 60]],
                "hysteresis [V]": h[[0, 7, 30, 60]],
                "length": len(h),
                "area [V^2]": loop_area(voltage, h),
                "describing function": describing_function(voltage, h),
                "harmonics [V]": harmonics(h, 5),
                "distortion": total_harmonic_distortion(harmonics(h, 5)),
            }
        told[f"{name}, linear [m/V]"] = linearised(p)(2j * np.pi * 1e3)
        told[f"{name}, natural frequency [Hz]"] = p.natural_frequency
    told["samples unless told"] = len(hysteresis_loop(HysteresisParameters(), 10.0, 1.0)[0])
    told["harmonics of two cycles"] = harmonics(np.sin(np.linspace(0.0, 4.0 * np.pi, 33)) + 0.3, 2, 2)
    told["exponent from"] = edge(
        lambda one: or_refused(lambda: HysteresisParameters(exponent=one).mass).__class__, 0.5, 1.5
    )
    return told


@NUMBERS.case()
def blocks_of_a_loop() -> dict[str, Any]:
    matrices = massless_matrices(PAPER)
    pid = Pid(2e5, 3e7, 20.0, 1e-4, -4.0, 5.0)
    memory, commands = PidMemory(), []
    for error in (1e-5, 2e-5, -1e-5, 3e-5, -4e-5, 0.0):
        command, memory = pid_step(pid, memory, error, 1e-4)
        commands.append([command, memory.integral, memory.error])
    run = run_loop(
        matrices,
        lambda m, e: pid_step(pid, m, e, 1e-4),
        PidMemory(),
        np.full(80, 1e-5),
        1e-4,
        delay=2,
        noise=1e-7 * np.cos(np.arange(80.0)),
    )
    swing = run_loop(
        matrices,
        lambda high, e: ((0.5 if relay(high, e) else -0.5), relay(high, e)),
        False,
        np.zeros(900),
        5e-5,
        delay=3,
    )

    def refused(**of: float) -> bool:
        return isinstance(or_refused(lambda: Pid(1.0, **of).proportional), str)

    return {
        "noise": band_limited_noise(np.random.default_rng(1), 4, 1e-3, 2e-5),
        "relay": [relay(high, error, 1.0) for high in (False, True) for error in (-0.6, -0.4, 0.0, 0.4, 0.6)],
        "relay without width": [relay(False, 0.1), relay(True, 0.0), relay(True, -0.1)],
        "commands": commands,
        "unlimited": list(vars(pid_step(Pid(2.0), PidMemory(0.5), 0.25, 0.1)[1]).values()),
        "loop": {name: getattr(run, name)[[0, 1, 3, 4, 20, 79]] for name in ("time", "command", "output", "measured")},
        "ultimate gain and frequency [Hz]": list(ultimate_point(swing, 0.5)),
        "too short a swing": or_refused(lambda: ultimate_point(run, 0.5)),
        "refused": [
            refused(filter_time=-1e-9),
            refused(filter_time=0.0),
            refused(low=1.0, high=1.0),
            refused(low=0.9, high=1.0),
            refused(integral=np.inf),
            refused(derivative=np.nan),
        ],
    }


@NUMBERS.case()
def vibration_in_time() -> dict[str, Any]:
    force = 5.0 * np.sin(0.3 * np.arange(60.0))
    told: dict[str, Any] = {}
    for name, p in {"paper": PAPER, "varied": VARIED, "fast": FAST}.items():
        for length in (None, 7):
            x, v = vibration_run(p, force, 2e-5, start=1e-6, speed=2e-3, memory=length)
            told[f"{name}, memory {length}"] = [x[[0, 1, 20, 59]], v[[0, 1, 20, 59]]]
    constants = (0.03, 3e5, 4e11, 12.0, 900.0 / 2e-5**0.7)
    x, v = forced_vibration(force[:20], 1e-6, 2e-3, constants, gl_weights(0.7, 6), 2e-5)
    told["as plain Python"] = [x[[0, 1, 9, 19]], v[[0, 1, 9, 19]]]
    told["from rest"] = vibration_run(PAPER, force, 2e-5)[0][[0, 1, 59]]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
