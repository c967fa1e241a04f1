"""The gear-pump electro-hydrostatic actuator: its parameters, and its reduced and lumped models.

Level 1, *reduced*, is equation 5.14 solved for the third derivative of position: the plant that the paper's own filter
assumes. Level 2, *lumped*, keeps the flow balance 5.8 and the force balance 5.9 separate, with differential pressure as
a state, so that friction is not differentiated and the piston really sticks (errata E9).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple, TypeAlias

from plant.compiled.functions import Scalar, absolute, sign, where
from plant.compiled.hints import affine_form, frozen, waypoint, with_derivatives
from plant.components.friction import quadratic_friction, sliding
from plant.components.valves import pumped_flow, relief_flow
from plant.errors import RigError
from plant.solvers.steps import GAMMA, parameter_names
from plant.units import require_numbers, si

JUDGED = "judged: the paper gives none"


@dataclass(frozen=True, kw_only=True)
class EhaParameters:
    """Parameters of the actuator, Tables 2 to 4, normal condition by default.

    Bulk modulus is in the convention of equation 5.8: the compression flow is
    ``chamber_volume / bulk_modulus`` times the rate of the *differential* pressure (errata E2).

    Raises
    ------
    RigError
        If a value is not a finite number, or a quantity that must be positive is not.

    Examples
    --------
    >>> EhaParameters().piston_area
    0.00152
    """

    pump_displacement: float = si(5.57e-7, "m^3/rad", "pump displacement D_p", "Table 2, errata E1")
    piston_area: float = si(1.52e-3, "m^2", "effective piston area A", "Table 2")
    chamber_volume: float = si(
        1.08e-3, "m^3", "V_0: half the oil of one chamber in mid-stroke, with port and hose", "Table 2, errata E2"
    )
    moving_mass: float = si(7.376, "kg", "moving mass M", "section 5")
    bulk_modulus: float = si(2.07e8, "Pa", "effective bulk modulus beta", "section 7, errata E2, E20")
    leakage_coefficient: float = si(4.784e-12, "m^3/(s Pa)", "lumped leakage L_t", "Table 3, errata E5", zero=True)
    flow_bias: float = si(2.413e-6, "m^3/s", "flow bias Q_b", "Table 3, errata E8", zero=True)
    friction_quadratic: float = si(6.589e4, "N s^2/m^2", "quadratic friction a_1", "Table 4", zero=True)
    friction_linear: float = si(2.144e3, "N s/m", "linear friction a_2", "Table 4, errata E12", signed=True)
    friction_coulomb: float = si(436.0, "N", "Coulomb friction a_3", "Table 4", zero=True)
    relief_pressure: float = si(3.4475e6, "Pa", "relief setting, either direction", "sections 2, 3: 500 psi")
    relief_conductance: float = si(
        1e-8,
        "m^3/(s Pa)",
        "relief flow per pascal above the setting",
        "judged: rated pump flow within 7 kPa",
        zero=True,
    )
    accumulator_pressure: float = si(2.758e5, "Pa", "inner circuit, absolute", "section 2: 40 psi")
    accumulator_gas: float | None = si(
        None, "m^3", "gas of the inner circuit's accumulator at its pressure, if known", "the paper gives none"
    )
    makeup_conductance: float = si(
        1e-9, "m^3/(s Pa)", "make-up flow per pascal below the inner circuit", JUDGED, zero=True
    )
    motor_speed_per_volt: float = si(
        31.41592653589793, "rad/(s V)", "motor speed per volt of command", "section 7: 4 V is 1200 rpm, errata E1"
    )
    motor_speed_limit: float = si(251.4, "rad/s", "highest motor speed", "section 4: 8 V input mean")
    stroke: float | None = si(None, "m", "full stroke of the piston, if known", "the paper gives none")
    area_difference: float = si(
        0.0, "1", "difference of the areas of sides A and B over their sum", "0: a through rod", signed=True
    )
    volume_difference: float = si(
        0.0, "1", "difference of the volumes of chambers A and B in mid-stroke over their sum", "0: alike", signed=True
    )
    pilot_share: float = si(
        0.0, "1", "make-up flow through pilot-operated valves, over that of plain check valves", "0: plain checks"
    )
    load_force: float = si(0.0, "N", "constant load on the rod, against extension", "none in the paper", signed=True)
    load_stiffness: float = si(0.0, "N/m", "spring on the rod, free in mid-stroke", "none in the paper")

    def __post_init__(self) -> None:
        require_numbers(self)
        for name in PAIRS.values():
            if not -1.0 < getattr(self, name) < 1.0:
                raise RigError(f"{name} must lie between -1 and 1, got {getattr(self, name)!r}")

    @property
    def rated_speed(self) -> float:
        """Motor speed at the paper's 4 V [rad/s]."""
        return 4.0 * self.motor_speed_per_volt

    @property
    def single_rod(self) -> bool:
        """Whether the piston has unequal areas, so that make-up valves open at every stroke."""
        return self.area_difference != 0.0

    @property
    def rated_flow(self) -> float:
        """Displaced flow of the pump at rated speed [m^3/s]."""
        return self.pump_displacement * self.rated_speed


PAIRS: Mapping[str, str] = {"piston_area": "area_difference", "chamber_volume": "volume_difference"}
"""Entries that a rig file may give as two numbers, for sides A and B: each with the entry for their difference over
their sum."""

VOLUME_SHARE = 0.75
"""Difference of the chambers' volumes over that of the piston's areas, where a rig file has two areas and one volume
[fraction]: swept volumes go with the areas, ports and hoses are alike. Judged: 0.66 to 0.79 in four typed rigs."""

SIZED_BY_PUMP = ("relief_conductance", "makeup_conductance")
"""Entries that scale with the pump's flow unless a rig file gives them: judged values of the paper's valves."""

JUDGED_STROKE = 0.25
"""Stroke [m] of a simulated actuator with unknown stroke: the paper gives none."""


PARAMETER_NAMES = parameter_names(EhaParameters)
"""Order of the columns of a parameter row."""

EhaValues: TypeAlias = EhaParameters | SimpleNamespace
"""What the models read: the parameters, or a namespace of the same names that holds expressions."""


def piston_areas(p: EhaValues) -> tuple[Scalar, Scalar]:
    """Return the areas of the piston's sides A and B.

    Returns
    -------
    tuple of float or Expression
        Areas [m^2].

    Examples
    --------
    >>> [round(1e4 * area, 2) for area in piston_areas(EhaParameters(piston_area=1.292e-3, area_difference=0.1765))]
    [15.2, 10.64]
    """
    return p.piston_area * (1.0 + p.area_difference), p.piston_area * (1.0 - p.area_difference)


def load_on_rod(position: Scalar, p: EhaValues) -> Scalar:
    """Return the load force on the rod: a constant load and a spring.

    Parameters
    ----------
    position : float or Expression
        Piston position [m].
    p : EhaParameters or namespace of Expression
        The actuator.

    Returns
    -------
    float or Expression
        Force against extension [N].
    """
    return p.load_force + p.load_stiffness * position


def reduced_derivative(
    state: tuple[Scalar, Scalar, Scalar], speed: Scalar, p: EhaValues
) -> tuple[Scalar, Scalar, Scalar]:
    """Return the rates of the reduced model, equation 5.14 with errata E3, E8 and E19.

    Valid only between reversals: it holds the sign of the velocity constant when equation 5.13 differentiates the
    Coulomb force (errata E9).

    Parameters
    ----------
    state : tuple of float or Expression
        Position [m], velocity [m/s], acceleration [m/s^2].
    speed : float or Expression
        Motor speed [rad/s].
    p : EhaParameters or namespace of Expression
        The actuator.

    Returns
    -------
    tuple of float or Expression
        Velocity [m/s], acceleration [m/s^2], jerk [m/s^3].
    """
    x, v, a = state
    A, V0, M, beta, L = p.piston_area, p.chamber_volume, p.moving_mass, p.bulk_modulus, p.leakage_coefficient
    a1, a2, a3 = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    direction = sign(v)
    pumped = pumped_flow(speed, p.pump_displacement, p.flow_bias)
    swept = A * v
    leaked = L / A * (quadratic_friction(v, direction, a1, a2, a3) + load_on_rod(x, p)) + L * M / A * a
    damping = (a2 + 2.0 * a1 * v * direction) / M * a + p.load_stiffness / M * v
    return v, a, A * beta / (M * V0) * (pumped - swept - leaked) - damping


def pressure_rate(velocity: Scalar, pressure: Scalar, speed: Scalar, p: EhaValues) -> Scalar:
    """Return the rate of differential pressure from the flow balance 5.8, with relief (errata E2, E8).

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    pressure : float or Expression
        Differential pressure [Pa].
    speed : float or Expression
        Motor speed [rad/s].
    p : EhaParameters or namespace of Expression
        The actuator.

    Returns
    -------
    float or Expression
        Rate of differential pressure [Pa/s].
    """
    pumped = pumped_flow(speed, p.pump_displacement, p.flow_bias)
    swept = p.piston_area * velocity
    leaked = p.leakage_coefficient * pressure
    relieved = relief_flow(pressure, p.relief_pressure, p.relief_conductance)
    return p.bulk_modulus / p.chamber_volume * (pumped - swept - leaked - relieved)


def lumped_step(
    state: tuple[Scalar, Scalar, Scalar], speeds: tuple[Scalar, Scalar], p: EhaValues, step: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Advance the lumped model by one L-stable implicit step, with friction as a set-valued law (errata E9).

    Each of the two stages of the SDIRK2 scheme is an implicit Euler step, which for these equations is a quadratic in
    the new velocity, solved in closed form (`sliding`). If the first stage ends stuck, the second starts from rest:
    friction has absorbed the momentum.

    Parameters
    ----------
    state : tuple of float or Expression
        Position [m], velocity [m/s], differential pressure [Pa].
    speeds : tuple of float or Expression
        Motor speed at the start and at the end of the step [rad/s], linear between.
    p : EhaParameters or namespace of Expression
        The actuator.
    step : float or Expression
        Time step [s].

    Returns
    -------
    tuple of float or Expression
        The state after the step.

    Examples
    --------
    >>> x, v, dp = lumped_step((0.0, 0.0, 0.0), (125.66, 125.66), EhaParameters(), 1e-4)
    >>> float(v), round(float(dp))
    (0.0, 1295)
    """
    start, end = speeds
    h = GAMMA * step
    x, v, dp = state
    _, first, pressure = _implicit_stage(state, start + GAMMA * (end - start), p, h)
    ratio = (1.0 - GAMMA) / GAMMA
    momentum_left = where(absolute(first) > 0.0, (1.0 - ratio) * v, 0.0)
    base = waypoint(x + ratio * (h * first)), waypoint(momentum_left + ratio * first), dp + ratio * (pressure - dp)
    return _implicit_stage((*base[:2], waypoint(base[2])), end, p, h, first)


class _StageSolution(NamedTuple):
    """A stage with its valve shut or open; ``held`` and ``filled`` describe the pressure.

    Without motion of the piston the pressure would be ``filled / held``.
    """

    held: Scalar
    filled: Scalar
    velocity: Scalar
    root: Scalar


def _implicit_stage(
    base: tuple[Scalar, Scalar, Scalar], speed: Scalar, p: EhaValues, h: Scalar, late: Scalar = None
) -> tuple[Scalar, Scalar, Scalar]:
    """Solve ``y = base + h f(y)`` of the lumped model, with the relief valve shut, then open if the pressure opens it.

    The base is affine in ``late``, which is the last quantity to be computed.
    """
    A, L, C = p.piston_area, p.leakage_coefficient, p.relief_conductance
    pumped = pumped_flow(speed, p.pump_displacement, p.flow_bias)
    shut = _solve_stage(base, L, pumped, p, h, late)
    pressure = shut.filled - h * p.bulk_modulus / p.chamber_volume * A * shut.velocity
    opens = absolute(pressure) > p.relief_pressure * shut.held
    offset = C * p.relief_pressure
    relieving = pumped + where(pressure > 0.0, offset, -offset)
    opened = _solve_stage(base, L + C, relieving, p, h, late)
    chosen = _StageSolution(*(where(opens, a, b) for a, b in zip(opened, shut, strict=True)))
    return _with_slopes(base, chosen, where(opens, L + C, L), where(opens, relieving, pumped), p, h)


def _solve_stage(
    base: tuple[Scalar, Scalar, Scalar], leaking: Scalar, delivered: Scalar, p: EhaValues, h: Scalar, late: Scalar
) -> _StageSolution:
    """Solve the stage with a flow ``delivered - leaking * dp`` into the chambers.

    The force balance is multiplied by ``held``, so that no division waits for another.
    """
    x, v, dp = base
    A, M = p.piston_area, p.moving_mass
    compliance = h * p.bulk_modulus / p.chamber_volume
    held = 1.0 + compliance * leaking
    filled = dp + compliance * delivered
    push = affine_form((M / h * v - load_on_rod(x, p)) * held + A * filled, late)
    resistance = (M / h + p.friction_linear + h * p.load_stiffness) * held + compliance * A * A
    return _StageSolution(
        held, filled, *sliding(push, resistance, p.friction_quadratic * held, p.friction_coulomb * held)
    )


def _with_slopes(
    base: tuple[Scalar, Scalar, Scalar],
    solved: _StageSolution,
    leaking: Scalar,
    delivered: Scalar,
    p: EhaValues,
    h: Scalar,
) -> tuple[Scalar, Scalar, Scalar]:
    """Return the stage's state, with derivatives from its balances of force and flow."""
    x, v, dp = base
    A, M, a1, a2, a3 = p.piston_area, p.moving_mass, p.friction_quadratic, p.friction_linear, p.friction_coulomb
    held, filled, new_v, root = solved
    compliance = h * p.bulk_modulus / p.chamber_volume

    u, area = frozen(new_v), frozen(A)
    pressure = frozen((filled - compliance * A * u) / held)
    flow = (delivered - leaking * dp - A * u) / held
    stored = compliance * with_derivatives(flow, (delivered - leaking * pressure - A * u, 1.0))
    force = M / h * (v - u) + A * pressure - load_on_rod(x + h * u, p) - quadratic_friction(u, sign(u), a1, a2, a3)
    balance = waypoint(waypoint(0.5 * (frozen(held) * force + area * dp)) + 0.5 * area * stored)
    new_v = waypoint(with_derivatives(new_v, (balance, where(absolute(u) <= 0.0, 0.0, 1.0 / root))))

    flow = with_derivatives(flow, (delivered - leaking * pressure - A * new_v, 1.0))
    new_dp = with_derivatives((filled - compliance * A * new_v) / held, (dp + compliance * flow, 1.0 / held))
    return x + h * new_v, new_v, new_dp
