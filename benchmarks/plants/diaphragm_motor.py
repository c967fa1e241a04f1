"""The diaphragm motor: published flow, balances, speed, and scipy's solvers on the same rates.

Peers run in this process, on the plant's rates as written and on its compiled rates with their analytic Jacobian.
Errors are those of the electrodes' deflections and of the mean flow, over the settled cycles, against LSODA at 1e-9. A
peer counts at the loosest tolerance whose error is no larger than ours. Times are processor times.
"""

import argparse
from typing import Any

import numpy as np
from scipy import integrate

from benchmarks.peers.stiff_solvers import Method, reference_trajectory
from benchmarks.targets import check_target, misses, processor_time
from plant.diaphragm_motor.flow import operate, pump_alone
from plant.diaphragm_motor.model import (
    FLOWS,
    SIDE_B,
    MotorRow,
    at_rest,
    deflections,
    motor_derivative,
    motor_row,
    reassemble_rows,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import LONGEST_STEP, RAMP_TIME, motor_drive, run_motor

HEALTHY = DiaphragmMotorParameters()
PUMP = pump_alone(HEALTHY)
PEAK, SWING = 480.0, 200.0
ML_MIN = 1e-6 / 60.0
RUN_TIME = 0.12
SCALE = np.array([2e4] * 7 + [10.0] + [2e-6] * 8 + [1.0] * 8 + [1e4, 1e4, 5e-3, 1e-4])
"""Typical change of each state [SI]."""

TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6)
"""Tolerances of a peer, loosest first."""

METHODS: tuple[Method, ...] = ("odeint", "LSODA")
"""Scipy's solvers; its BDF and Radau stop on a Jacobian that is not finite."""


def physics() -> None:
    """Compare with the figures that the paper quotes, and check balances."""
    point = operate(PUMP, PEAK, SWING)
    flow = point.outlet_flow / ML_MIN
    frequencies = np.arange(400.0, 561.0, 5.0)
    points = [operate(PUMP, frequency, SWING) for frequency in frequencies]
    best = frequencies[int(np.argmax([one.outlet_flow for one in points]))]
    check_target("peak flow off 110 ml/min", abs(max(one.outlet_flow for one in points) / ML_MIN - 110.0), 2.0)
    check_target("frequency of the peak off 480 Hz", abs(best - 480.0), 10.0)
    for middle in (2, 3, 4):
        peak = frequencies[int(np.argmax([abs(one.tones[middle]) for one in points]))]
        check_target(f"frequency of A{middle + 1}'s peak off 480 Hz", abs(peak - 480.0), 10.0)
    check_target("inlet less outlet, relative", abs(point.inlet_flow / point.outlet_flow - 1.0), 2e-3)
    halved = operate(PUMP, PEAK, SWING, longest_step=0.5 * LONGEST_STEP).outlet_flow / ML_MIN
    check_target("what halving the step changes, relative", abs(flow / halved - 1.0), 3e-3)


def speed(repeats: int) -> None:
    """Time an operating point and a sweep."""
    seconds = [processor_time(lambda: operate(PUMP, PEAK, SWING))[0] for _ in range(repeats)]
    check_target("one operating point, median [ms]", 1e3 * float(np.median(seconds)), 20.0)
    sweep = processor_time(lambda: [operate(PUMP, frequency, SWING) for frequency in np.linspace(20.0, 800.0, 60)])[0]
    check_target("sweep of 60 points, 20 to 800 Hz [s]", sweep, 2.0)


def rates(state: tuple[Any, ...], rate: Any, flat: Any) -> tuple[Any, ...]:
    """Return the plant's rates in the form that a solver needs."""
    return motor_derivative(state, rate, reassemble_rows(flat))


def run_peers(repeats: int) -> None:
    """Run scipy's stiff solvers on the loaded motor to our error."""
    drive = motor_drive(PEAK, SWING, RUN_TIME, LONGEST_STEP)
    moments = LONGEST_STEP * np.arange(len(drive))
    angle = 2.0 * np.pi * PEAK * moments
    swing = 0.5 * SWING
    rising = moments < RAMP_TIME
    rate = 2.0 * np.pi * PEAK * swing * np.minimum(moments / RAMP_TIME, 1.0) * np.cos(angle)
    rate += np.where(rising, swing / RAMP_TIME * np.sin(angle), 0.0)
    start = at_rest(HEALTHY)
    start[SIDE_B] = 1.0  # the square root in the return land's flow has no slope at zero
    row = MotorRow(*motor_row(HEALTHY))
    settled = round(0.5 * RUN_TIME / LONGEST_STEP)

    def solve(method: Method, tolerance: float) -> np.ndarray:
        return reference_trajectory(
            rates, start, rate, row, LONGEST_STEP, scale=SCALE, relative_tolerance=tolerance, method=method
        )

    def as_written(tolerance: float) -> np.ndarray:
        def slope(x: np.ndarray, t: float) -> list[float]:
            return [float(value) for value in motor_derivative(tuple(x), np.interp(t, moments, rate), HEALTHY)]

        absolute = tolerance * SCALE
        odeint: Any = integrate.odeint  # the stubs do not accept an array of tolerances
        return odeint(slope, start, moments, rtol=tolerance, atol=absolute, hmax=10.0 * LONGEST_STEP, mxstep=100000)

    def seen(states: np.ndarray) -> tuple[np.ndarray, float]:
        return deflections(states, drive, HEALTHY)[settled:], float(states[settled:, FLOWS].mean())

    bent, flow = seen(solve("LSODA", 1e-9))

    def errors(states: np.ndarray) -> tuple[float, float]:
        deflected, found = seen(states)
        return float(np.sqrt(np.mean((deflected - bent) ** 2)) / np.ptp(bent)), abs(found / flow - 1.0)

    taken = [processor_time(lambda: run_motor(HEALTHY, drive, LONGEST_STEP, start=start)) for _ in range(repeats)]
    ours = float(np.median([seconds for seconds, _ in taken]))
    wanted = errors(taken[0][1])
    print(f"       ours: {1e3 * ours:.1f} ms, deflections {wanted[0]:.1e}, mean flow {wanted[1]:.1e}")
    compiled: dict[str, tuple[float, float]] = {}
    for method in METHODS:
        for tolerance in TOLERANCES:
            seconds, states = processor_time(lambda m=method, t=tolerance: solve(m, t))
            reached = errors(states)
            print(f"       {method} at {tolerance:g}: {seconds:.3f} s, {reached[0]:.1e}, {reached[1]:.1e}")
            if reached[0] <= wanted[0] and reached[1] <= wanted[1]:
                compiled[method] = (seconds, tolerance)
                break
    best, (_, tolerance) = min(compiled.items(), key=lambda item: item[1][0])
    again = float(np.median([processor_time(lambda: solve(best, tolerance))[0] for _ in range(repeats)]))
    check_target(f"speed over {best} on our compiled rates and Jacobian, at equal error", again / ours, 5.0, most=False)
    seconds, states = processor_time(lambda: as_written(tolerance))
    reached = errors(states)
    print(
        f"       note: odeint on the rates as written, at {tolerance:g}: {seconds / ours:.3g} times our time, "
        f"{reached[0]:.1e}, {reached[1]:.1e}"
    )


def main(arguments: list[str]) -> int:
    """Print every figure; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9, help="repeats of which the median time counts")
    options = parser.parse_args(arguments)
    misses.clear()
    operate(PUMP, PEAK, SWING)
    physics()
    speed(options.repeats)
    run_peers(options.repeats)
    return len(misses)
