"""Kinds with a fault or a change that is in none of the nine conditions."""

from dataclasses import replace

import numpy as np

from experiments.open_benchmark.friction import steady_friction
from experiments.open_benchmark.kind import OWN_OR_UNKNOWN, UNKNOWN, Draw, Kind
from experiments.open_benchmark.setup import Setup
from faults.conditions import LEAKAGE_TABLE

ONLY_UNKNOWN = (UNKNOWN,)
"""The right verdict on a log that fits none of the nine."""


def _with_machine(**changes: float) -> Draw:
    return lambda setup, _: setup.with_machine(**changes)


def _leaking_seat(setup: Setup, rng: np.random.Generator) -> Setup:
    return setup.with_machine(seat_leak_a=rng.uniform(0.5, 2.0) * LEAKAGE_TABLE["major"].leakage_coefficient)


def _low_relief(setup: Setup, rng: np.random.Generator) -> Setup:
    """Set the relief valve between the piston's breakaway pressure and the pressure near its rated speed."""
    m = setup.machine
    fast = 0.75 * setup.rated_speed * m.displacement / m.area_a
    blocks, film = steady_friction(fast, 1.0, m)
    force = m.coulomb + rng.uniform(0.2, 0.5) * (blocks + film - m.coulomb)
    return setup.with_machine(relief=force / m.area_a)


STARVING = (
    *("minor_friction", "major_friction", "minor_leakage_minor_friction"),
    *("minor_leakage_major_friction", "major_leakage_major_friction"),
)
"""Conditions whose pressures empty a chamber that has no make-up flow."""

FAULT_KINDS = (
    Kind(
        "worn_pump",
        "worn pump: 80 % of the flow, no more leakage",
        _with_machine(efficiency=0.8),
        ONLY_UNKNOWN,
        r"\bpump|efficien|\bworn",
    ),
    Kind(
        "makeup_check_stuck_shut",
        "make-up check of side B stuck shut: it boils",
        lambda setup, _: replace(setup.with_machine(check_b=0.0), forward_first=True),
        ONLY_UNKNOWN,
        r"make-?up|check valve|cavitat|vapou?r",
        conditions=STARVING,
    ),
    Kind(
        "makeup_check_leaks",
        "make-up check of side A leaks",
        _leaking_seat,
        ONLY_UNKNOWN,
        r"make-?up|check valve|one side",
    ),
    Kind(
        "relief_set_low",
        "relief valve opens at the pressure of a slow piston",
        _low_relief,
        ONLY_UNKNOWN,
        r"relief",
    ),
    Kind(
        "intermittent_friction",
        "Coulomb friction three- to sixfold in six bursts",
        lambda setup, rng: setup.with_change(bursts=6, grip=rng.uniform(3.0, 6.0)),
        (UNKNOWN, "minor_friction", "major_friction"),
        r"intermittent|burst|at times|comes and goes",
        conditions=("normal",),
    ),
    Kind(
        "entrained_air",
        "0.5 to 3 % of entrained air",
        lambda setup, rng: setup.with_change(air=rng.uniform(0.005, 0.03)),
        OWN_OR_UNKNOWN,
        r"\bair\b",
    ),
    Kind(
        "air_midway",
        "1 to 4 % of air gets in between 40 and 60 % of the log",
        lambda setup, rng: setup.with_change(late_air=rng.uniform(0.01, 0.04), late_from=rng.uniform(0.4, 0.6)),
        ONLY_UNKNOWN,
        r"\bair\b|soften",
    ),
    Kind(
        "leakage_grows",
        "leakage grows from none to major over the log",
        lambda setup, _: setup.with_change(wear=LEAKAGE_TABLE["major"].leakage_coefficient / setup.machine.leakage),
        (UNKNOWN, "minor_leakage", "major_leakage"),
        r"\bgrow|\btrend|\bdrift",
        conditions=("normal",),
    ),
    Kind(
        "leakage_sets_in",
        "leakage jumps from none to major between 30 and 70 % of the log",
        lambda setup, rng: setup.with_change(
            late_wear=LEAKAGE_TABLE["major"].leakage_coefficient / setup.machine.leakage,
            late_from=rng.uniform(0.3, 0.7),
        ),
        (UNKNOWN, "minor_leakage", "major_leakage"),
        r"since [\d.]+ s|\bgrow",
        conditions=("normal",),
        severity=False,
    ),
    Kind(
        "oil_warms",
        "viscosity halves over the log",
        lambda setup, _: setup.with_change(viscosity=0.5),
        named=r"viscos|\bwarm|\btrend|\bdrift",
        severity=False,
    ),
    Kind(
        "leakage_partly_turbulent",
        "30 % of the leakage is turbulent at 5 bar",
        _with_machine(turbulent=0.3),
        OWN_OR_UNKNOWN,
        severity=False,
    ),
)
"""Kinds with a fault beyond the nine, or a change within the log."""
