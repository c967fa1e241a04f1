"""With the pump stopped, the circuit only loses energy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from faults.eha.physical import with_throttles
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE, NUCLEI, specific_volume
from plant.eha.circuit import chamber_volumes, circuit_pressures
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.simulate import CIRCUIT
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory

PAPER = CircuitParameters()


def enthalpy(pressure: Array, p: CircuitParameters) -> Array:
    """Return the integral of the specific volume over pressure from atmospheric pressure [J a unit amount]."""
    air = p.air_fraction + NUCLEI
    over = pressure - ATMOSPHERE
    gas = air * (ATMOSPHERE - p.vapour_pressure)
    logarithm = np.log((pressure - p.vapour_pressure) / (ATMOSPHERE - p.vapour_pressure))
    return (1.0 - air) * (over - over**2 / (2.0 * p.bulk_modulus)) + gas * logarithm


def chamber_energy(oil: Array, pressure: Array, p: CircuitParameters) -> Array:
    room = specific_volume(pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
    return oil * (enthalpy(pressure, p) - pressure * room)


def accumulator_energy(oil: Array, p: CircuitParameters) -> Array:
    """Return the integral of the oil's enthalpy over the oil taken in since the charge, by Gauss's rule."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    taken = oil - p.accumulator_oil
    at = p.accumulator_oil + 0.5 * taken[:, None] * (nodes + 1.0)
    pressure = circuit_pressures(0.0, (at, at, at), p).supply
    return 0.5 * taken * (enthalpy(pressure, p) @ weights)


def stored_energy(states: Array, p: CircuitParameters) -> Array:
    _, bristle, x, v, oil_a, oil_b, held = states.T
    pressures = circuit_pressures(x, (oil_a, oil_b, held), p)
    depth = np.maximum(np.abs(x) - 0.5 * p.stroke, 0.0)
    moving = 0.5 * p.moving_mass * v**2 + 0.5 * p.end_stop_stiffness * depth**2
    seals = 0.5 * p.friction_coulomb * p.presliding_displacement * bristle**2
    chambers = chamber_energy(oil_a, pressures.a, p) + chamber_energy(oil_b, pressures.b, p)
    return moving + seals + chambers + accumulator_energy(held, p)


def at_pressures(a: float, b: float, x: float, v: float, p: CircuitParameters) -> Array:
    volumes = chamber_volumes(x, p)
    oil = [
        volume / specific_volume(pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
        for volume, pressure in zip(volumes, (a, b), strict=True)
    ]
    return np.array([0.0, 0.0, x, v, *oil, p.accumulator_oil])


PRESSURES = st.floats(3e3, 5e6)


@settings(max_examples=25)
@given(
    PRESSURES,
    PRESSURES,
    st.floats(-0.12, 0.12),
    st.floats(-0.5, 0.5),
    st.floats(0.0, 0.2),
    st.sampled_from([(10.0, 0.0), (2.0, 2.3), (0.0, 0.0), (1.75, 2.5)]),
)
def test_stored_energy_never_rises_with_the_pump_stopped(
    a: float, b: float, x: float, v: float, air: float, volts: tuple[float, float]
) -> None:
    p = with_throttles(CircuitParameters(air_fraction=air), *volts)
    row = parameter_row(p)
    run = compile_trajectory(CIRCUIT.name, CIRCUIT.step, 7, CircuitParameters)
    states = run(at_pressures(a, b, x, v, p), np.zeros(3_000), row[None], 1e-4, CIRCUIT.substeps)
    energy = stored_energy(states, p)
    assert np.max(np.diff(energy)) <= 1e-6 * np.ptp(energy)
    assert energy[-1] <= energy[0]


def test_the_energy_of_a_chamber_is_the_work_done_on_it() -> None:
    oil, volumes = 2.2e-3, np.linspace(2.20e-3, 2.15e-3, 20_001)
    pressure = circuit_pressures((volumes - 2.0 * PAPER.chamber_volume) / PAPER.piston_area, (oil, oil, 1e-3), PAPER).a
    work = -np.trapezoid(pressure, volumes)
    energy = chamber_energy(np.full(2, oil), pressure[[0, -1]], PAPER)
    assert energy[1] - energy[0] == pytest.approx(work, rel=1e-6)
