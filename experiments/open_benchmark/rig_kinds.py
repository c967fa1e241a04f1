"""Kinds with another actuator: one that its rig file describes, one that it does not, and one with a load."""

from dataclasses import replace

import numpy as np

from experiments.open_benchmark.draws import draw_plain
from experiments.open_benchmark.drives import CLOSED
from experiments.open_benchmark.kind import OWN_OR_UNKNOWN, Draw, Kind
from experiments.open_benchmark.setup import Setup
from plant.eha.model import EhaParameters

PAPER = EhaParameters()

RIG_ENTRIES = (
    *("pump_displacement", "piston_area", "chamber_volume", "moving_mass", "leakage_coefficient", "flow_bias"),
    *("friction_quadratic", "friction_linear", "friction_coulomb"),
)
"""Entries in the rig file of another actuator."""

SINGLE_ROD = 0.7
"""Ratio of the rod-side area to the other."""


def _scaled_machine(**factors: float) -> Draw:
    """Return the fields of a machine that differ from the rig file."""
    return lambda setup, _: setup.with_machine(**{n: k * getattr(setup.machine, n) for n, k in factors.items()})


def _factor(low: float, high: float, *names: str) -> Draw:
    """Return the difference between a machine and its rig file by one factor, drawn log-uniformly."""

    def draw(setup: Setup, rng: np.random.Generator) -> Setup:
        factor = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        return _scaled_machine(**dict.fromkeys(names, factor))(setup, rng)

    return draw


def _oil(low: float, high: float) -> Draw:
    """Return a log-uniform draw of the oil's bulk modulus [Pa]."""
    return lambda setup, rng: setup.with_machine(bulk_modulus=float(np.exp(rng.uniform(np.log(low), np.log(high)))))


def _big_actuator(setup: Setup, rng: np.random.Generator) -> Setup:
    base = replace(
        PAPER,
        pump_displacement=4.0 * PAPER.pump_displacement,
        piston_area=3.0 * PAPER.piston_area,
        chamber_volume=3.0 * PAPER.chamber_volume,
        moving_mass=3.0 * PAPER.moving_mass,
        leakage_coefficient=4.0 * PAPER.leakage_coefficient,
        flow_bias=4.0 * PAPER.flow_bias,
        friction_quadratic=27.0 / 16.0 * PAPER.friction_quadratic,
        friction_linear=9.0 / 4.0 * PAPER.friction_linear,
        friction_coulomb=3.0 * PAPER.friction_coulomb,
    )
    drawn = draw_plain(setup.condition, setup.drive, rng, base)
    return replace(drawn, rig={name: getattr(base, name) for name in RIG_ENTRIES})


def _single_rod(setup: Setup, _: np.random.Generator) -> Setup:
    m = setup.machine
    one = setup.with_machine(area_b=SINGLE_ROD * m.area_b, volume_b=SINGLE_ROD * m.volume_b, pilot=3.0, supply_gas=0.02)
    mean = 0.5 * (1.0 + SINGLE_ROD)
    return replace(one, rig={"piston_area": mean * PAPER.piston_area, "chamber_volume": mean * PAPER.chamber_volume})


RIG_KINDS = (
    Kind("big_actuator", "area, mass, volume x3, pump x4; the rig file says so", _big_actuator, draws_anew=True),
    Kind("stiff_oil", "bulk modulus 0.7e9 to 1.5e9, rig file unedited", _oil(0.7e9, 1.5e9)),
    Kind("soft_oil", "bulk modulus 4e7 to 6e7, rig file unedited", _oil(4e7, 6e7), OWN_OR_UNKNOWN),
    Kind(
        "oil_stiffens",
        "bulk modulus grows by 5 to 12 Pa a pascal, as mineral oil's does",
        lambda setup, rng: setup.with_machine(stiffening=rng.uniform(5.0, 12.0)),
        OWN_OR_UNKNOWN,
    ),
    Kind(
        "checks_crack_late",
        "make-up checks open 10 to 30 kPa below the accumulator's pressure",
        lambda setup, rng: setup.with_machine(crack_a=rng.uniform(1e4, 3e4), crack_b=rng.uniform(1e4, 3e4)),
        OWN_OR_UNKNOWN,
    ),
    Kind(
        "rig_volume_25_percent_low",
        "dead volume a third above the rig file's",
        _scaled_machine(volume_a=4 / 3, volume_b=4 / 3),
    ),
    Kind("rig_area_4_percent_high", "area 4 % under the rig file's", _scaled_machine(area_a=1 / 1.04, area_b=1 / 1.04)),
    Kind("rig_mass_half_of_true", "twice the rig file's moving mass", _scaled_machine(mass=2.0)),
    Kind("rig_volume_wrong", "dead volume 0.7 to 1.4 of the rig file's", _factor(0.7, 1.4, "volume_a", "volume_b")),
    Kind("rig_area_wrong", "area 0.93 to 1.07 of the rig file's", _factor(0.93, 1.07, "area_a", "area_b")),
    Kind("rig_mass_wrong", "0.5 to 2.5 of the rig file's moving mass", _factor(0.5, 2.5, "mass")),
    Kind("rig_displacement_wrong", "0.93 to 1.07 of the rig file's displacement", _factor(0.93, 1.07, "displacement")),
    Kind(
        "pump_ripples",
        "the teeth of the pump are 5 to 15 % in its flow",
        lambda setup, rng: setup.with_machine(ripple=rng.uniform(0.05, 0.15)),
    ),
    Kind(
        "single_rod",
        "single rod, area ratio 0.7, pilot-operated checks; rig file: mean area, mean volume",
        _single_rod,
        OWN_OR_UNKNOWN,
        severity=False,
    ),
    Kind(
        "constant_load",
        "1 to 2.5 kN on the rod, position loop",
        lambda setup, rng: setup.with_machine(load=rng.uniform(1e3, 2.5e3)),
        OWN_OR_UNKNOWN,
        r"\bload",
        tuple(CLOSED),
        severity=False,
    ),
    Kind(
        "spring_load",
        "a spring of 5 to 15 N/mm on the rod",
        lambda setup, rng: setup.with_machine(spring=rng.uniform(5e3, 15e3)),
        OWN_OR_UNKNOWN,
        r"\bspring|\bload",
        tuple(CLOSED),
        severity=False,
    ),
)
"""Kinds with another actuator. If the rig file is wrong, the condition's own coefficients are the truth."""
