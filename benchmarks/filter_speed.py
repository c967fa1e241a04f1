"""Cost of one filter step: the compiled filter and filterpy's, interleaved in one process, CPU time, medians."""

import time
from statistics import median

import numpy as np

from estimation.bulk_modulus import first_belief
from estimation.eha import FORMS
from estimation.ekf import ekf
from estimation.filter import Method
from estimation.filterpy_bridge import filterpy_ekf
from estimation.run import run_filter
from plant.eha import EhaParameters
from plant.record import Record
from plant.sensors import BENCH
from plant.signals import make_drive
from plant.simulate import LUMPED, simulate

ROUNDS = 5


def step_cost(method: Method, record: Record, form: str) -> float:
    """Return CPU nanoseconds a sample of one filter over a record."""
    p, model = EhaParameters(), FORMS[form]
    prior = first_belief(model, record, 1e8, 3e8)
    channels = ("position_m", "velocity_m_s")
    variances = {"position_m": 1e-12, "velocity_m_s": 1e-6}
    begin = time.process_time_ns()
    run_filter(method, model, prior, record, p, channels=channels, variances=variances)
    return (time.process_time_ns() - begin) / len(record)


def main(arguments: list[str]) -> int:
    """Print the table."""
    del arguments
    rng = np.random.default_rng(1)
    p = EhaParameters()
    record = simulate(LUMPED, make_drive("steps", 10.0, 1e-4, p, rng), 1e-4, p, sensors=BENCH, rng=rng)
    short = record.slice(0, 2000)
    print(f"{'form':14s}{'compiled ns':>14s}{'filterpy ns':>14s}{'ratio':>10s}")
    for form in FORMS:
        for method in (ekf, filterpy_ekf):
            step_cost(method, short, form)
        pairs = [(step_cost(ekf, record, form), step_cost(filterpy_ekf, short, form)) for _ in range(ROUNDS)]
        ours, theirs = median(a for a, _ in pairs), median(b for _, b in pairs)
        print(f"{form:14s}{ours:14.1f}{theirs:14.0f}{theirs / ours:10.0f}")
    return 0
