"""The circuit with unequal make-up valves of chambers A and B: one is stuck shut, or its seat leaks.

Its parameters are the circuit's followed by four more, so the length of a row tells which circuit it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import cast

import numpy as np

from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.components.check_valve import check_valve_flow
from plant.eha.circuit import CircuitState, circuit_derivative, circuit_pressures
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.simulate import CIRCUIT, Plant
from plant.errors import RigError
from plant.solvers.adaptive import ErrorControl, controlled_groups
from plant.solvers.steps import parameter_names, ros2_step
from plant.units import si


@dataclass(frozen=True, kw_only=True)
class OneSidedParameters(CircuitParameters):
    """Parameters of a circuit, and the faults of the make-up valve of each chamber; no fault by default.

    Raises
    ------
    RigError
        As for `CircuitParameters`, and if the stuck share of a valve exceeds 1.

    Examples
    --------
    >>> OneSidedParameters(makeup_shut_b=1.0).makeup_conductance
    1e-09
    """

    makeup_shut_a: float = si(0.0, "1", "share of the make-up valve of chamber A that is stuck shut", "a fault")
    makeup_shut_b: float = si(0.0, "1", "share of the make-up valve of chamber B that is stuck shut", "a fault")
    seat_leakage_a: float = si(0.0, "m^3/(s Pa)", "leakage past the seat of chamber A's make-up valve", "a fault")
    seat_leakage_b: float = si(0.0, "m^3/(s Pa)", "leakage past the seat of chamber B's make-up valve", "a fault")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("makeup_shut_a", "makeup_shut_b"):
            if getattr(self, name) > 1.0:
                raise RigError(f"{name} must be at most 1, got {getattr(self, name)!r}")


def with_make_up_faults(p: CircuitParameters, **faults: float) -> OneSidedParameters:
    """Return a circuit with faults of its make-up valves.

    Parameters
    ----------
    **faults : float
        Entries of `OneSidedParameters` [each in its unit].
    """
    return OneSidedParameters(**{field.name: getattr(p, field.name) for field in fields(CircuitParameters)}, **faults)


def one_sided_derivative(state: CircuitState, command: Scalar, p: OneSidedParameters) -> CircuitState:
    """Return the rates of the circuit if a make-up valve is stuck shut or its seat leaks.

    Parameters
    ----------
    state : tuple of float or Expression
        As named in `plant.eha.circuit.STATES` [SI].
    command : float or Expression
        Commanded motor speed [rad/s].
    p : OneSidedParameters or namespace of Expression
        The circuit.

    Returns
    -------
    tuple of float or Expression
        Rates of the states, each per second.
    """
    *others, into_a, into_b, into_supply = circuit_derivative(state, command, p)
    _, _, position, _, *oil = state
    pressures = circuit_pressures(position, (oil[0], oil[1], oil[2]), p)

    def more(chamber: Scalar, shut: Scalar, seat: Scalar) -> Scalar:
        drop = pressures.supply - chamber
        return seat * drop - shut * check_valve_flow(drop, p.makeup_conductance, p.makeup_opening)

    more_a = more(pressures.a, p.makeup_shut_a, p.seat_leakage_a)
    more_b = more(pressures.b, p.makeup_shut_b, p.seat_leakage_b)
    turning, yielding, velocity, gaining = others
    return turning, yielding, velocity, gaining, into_a + more_a, into_b + more_b, into_supply - more_a - more_b


ONE_SIDED = replace(
    CIRCUIT,
    name="one_sided",
    step=ros2_step(one_sided_derivative),
    parameter_class=OneSidedParameters,
    control=replace(cast("ErrorControl", CIRCUIT.control), derivative=one_sided_derivative),
)

_WIDTH = len(parameter_names(OneSidedParameters))


def circuit_plant(width: int) -> Plant:
    """Return the circuit, or the circuit with unequal make-up valves.

    Parameters
    ----------
    width : int
        Number of parameters in its row.
    """
    return ONE_SIDED if width == _WIDTH else CIRCUIT


def padded_row(row: Array, width: int) -> Array:
    """Return a parameter row extended to another circuit's width; the added fault parameters are zero.

    Parameters
    ----------
    row : ndarray, shape (parameters,)
        The circuit [SI].
    width : int
        Number of parameters of the other circuit.

    Returns
    -------
    ndarray, shape (width,)
        The same circuit [SI].
    """
    return np.concatenate([row, np.zeros(width - len(row))])


def circuit_groups(
    starts: Array,
    speed: Array,
    rows: Array,
    sample_time: float,
    *,
    tolerance: float,
    drive_tolerance: float,
    bulge: float,
) -> Iterator[Array]:
    """Run circuits of one kind side by side in error-controlled steps, in groups.

    Parameters
    ----------
    starts : ndarray, shape (runs, states)
        Initial states in SI.
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s].
    rows : ndarray, shape (1 or n, runs, parameters)
        Their parameters.
    sample_time : float
        Seconds between samples [s].
    tolerance, drive_tolerance, bulge : float
        See `plant.solvers.adaptive.controlled_groups` [dimensionless].

    Returns
    -------
    iterator of ndarray, shape (n, states, some runs)
        States at the samples, see `plant.solvers.adaptive.controlled_groups`.
    """
    plant = circuit_plant(rows.shape[-1])
    control, whose = cast("ErrorControl", plant.control), plant.parameter_class
    allowed = {"tolerance": tolerance, "drive_tolerance": drive_tolerance, "bulge": bulge}
    return controlled_groups(plant.name, control, starts, speed, rows, sample_time, whose, **allowed)
