"""Rigs with worse sensors than the reference bench: coverage of bulk modulus, and calibration of class probabilities.

Bulk modulus is estimated with pressure on 10 s of the circuit plant with position sensors of 10 to 50 um. The hard
population has logs of 1 s with sensors so coarse that one log in five to twenty is assigned to the wrong condition.
Probabilities can be wrong there, so calibration is a real test. ``--seeds`` makes both larger or smaller.
"""

import argparse
import time
import warnings
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from benchmarks.diagnosis.diagnosis_checks import PAPER_RIG
from benchmarks.diagnosis.population import TEST, draw_logs
from benchmarks.diagnosis.scores import calibration_error, share_interval
from benchmarks.targets import Check, print_and_keep
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.finding import NORMAL_95
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.model import EhaParameters
from plant.errors import LogWarning
from plant.sensors.sensors import RIG, Sensors

FIRST_SEED = TEST + 900
"""First seed, separate from those of other benchmarks."""

SENSORS: Mapping[str, Sensors] = MappingProxyType(
    {
        "encoder of 1 um": RIG,
        "white noise of 10 um": replace(RIG, position_noise=1e-5),
        "steps of 20 um": replace(RIG, position_quantum=2e-5),
        "steps of 50 um": replace(RIG, position_quantum=5e-5),
        "noise of 50 um in steps of 50 um": replace(RIG, position_noise=5e-5, position_quantum=5e-5),
        "all four: 20 um, 10 um, 0.2 bar, 0.2 rad/s": replace(
            RIG, position_noise=2e-5, position_quantum=1e-5, pressure_noise=2e4, speed_noise=0.2
        ),
    }
)
"""Sensors to compare, including the rig's."""

HARD_SENSORS = replace(RIG, position_noise=2e-4, position_quantum=2e-4, pressure_noise=1e5, speed_noise=1.0)
"""Position to 0.2 mm, pressure to 1 bar, speed to 1 rad/s."""

OVERCONFIDENT = 0.9
"""Probability above which a wrong class counts as overconfident [probability]."""


def main(arguments: list[str]) -> int:
    """Print every figure with its target; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", LogWarning)
    checks: list[Check] = []
    for name, sensors in SENSORS.items():
        checks += bulk_modulus_checks(name, sensors, options.seeds)
    checks += probability_checks(options.seeds)
    short = sum(not check.met for check in checks)
    print(f"{short} of {len(checks)} fall short")
    return short


def bulk_modulus_checks(name: str, sensors: Sensors, seeds: int) -> list[Check]:
    """Return the errors and coverage of bulk modulus for some sensors."""
    began = time.process_time()
    logs, passed, errors, sizes = 0, 0, list[float](), list[float]()
    for log in draw_logs(range(FIRST_SEED, FIRST_SEED + seeds), sensors=sensors):
        found = estimate_bulk_modulus(log.record, EhaParameters())
        logs += 1
        if found.value is None or found.std is None:
            continue
        off = found.value - log.parameters.bulk_modulus
        passed += found.gate.passed
        errors.append(off / found.std)
        sizes.append(abs(off) / log.parameters.bulk_modulus)
    z = np.array(errors)
    print(
        f"{name}: {logs} logs, gate passed on {passed}, z {np.sqrt(np.mean(z**2)):.2f} rms, mean {np.mean(z):.2f}; "
        f"off by {100.0 * float(np.median(sizes)):.2f} % median, {100.0 * max(sizes):.2f} % at most; "
        f"{(time.process_time() - began) / logs:.2f} s CPU a log"
    )
    covered = 100.0 * float(np.mean(np.abs(z) < NORMAL_95))
    return print_and_keep([Check(f"{name}: 95 % intervals of bulk modulus that cover, %", covered, 90.0, 100.0)])


def probability_checks(seeds: int) -> list[Check]:
    """Return the calibration of class probabilities on logs that are hard to classify."""
    sure, right, unknown, silent = list[float](), list[bool](), 0, 0
    for log in draw_logs(range(FIRST_SEED, FIRST_SEED + 2 * seeds), sensors=HARD_SENSORS, duration=1.0):
        found = diagnose_log(log.record, PAPER_RIG)
        unknown += found.unknown
        silent += found.condition is None
        if found.condition is not None:
            sure.append(found.probabilities[found.condition])
            right.append(found.condition == log.condition)
    believed, hits = np.array(sure), np.array(right)
    low, high = (100.0 * end for end in share_interval(int(hits.sum()), len(hits)))
    print(f"hard logs: {len(hits)} with a class, {silent} without, {unknown} unknown; {low:.0f} to {high:.0f} % right")
    for least, most in ((0.0, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.01)):
        some = (believed >= least) & (believed < most)
        if np.any(some):
            print(f"  said {100 * np.mean(believed[some]):.0f} %: {100 * np.mean(hits[some]):.0f} % of {np.sum(some)}")
    broken = int(np.sum(~hits & (believed > OVERCONFIDENT)))
    return print_and_keep(
        [
            Check("hard logs: taken for another condition, %", 100.0 * float(np.mean(~hits)), 5.0, 20.0),
            Check("hard logs: calibration error (ECE, 15 bins)", calibration_error(believed, hits), 0.0, 0.1),
            Check(f"hard logs: wrong at over {100 * OVERCONFIDENT:.0f} %, of {len(hits)}", broken, 0, 0.01 * len(hits)),
            Check("hard logs: taken for unknown, %", 100.0 * unknown / (len(hits) + silent), 0.0, 3.0),
        ]
    )
