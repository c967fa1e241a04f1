"""The nine conditions of Table 1 as changes of parameters, and the same two axes as continuous severity."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from math import isfinite
from types import MappingProxyType
from typing import Annotated, Literal, TypeAlias, get_args

from plant.eha.model import EhaParameters
from plant.eha.scales import PAPER_RIG, friction_scales, leakage_scales
from plant.errors import HydrostateError, require_known
from plant.units import SI

Level: TypeAlias = Literal["none", "minor", "major"]

LEVELS: tuple[Level, ...] = get_args(Level)
"""The levels in rising order; the index of a level is its severity."""

HIGHEST_SEVERITY = 5.0
"""End of the extrapolation: above leakage 5.5 the paper's rig does not move at its rated speed."""


@dataclass(frozen=True, kw_only=True)
class LeakageLevel:
    """One row of Table 3."""

    leakage_coefficient: Annotated[float, SI("m^3/(s Pa)", "lumped leakage L_t", "Table 3, errata E5")]
    flow_bias: Annotated[float, SI("m^3/s", "flow bias Q_b", "Table 3")]


@dataclass(frozen=True, kw_only=True)
class FrictionLevel:
    """One row of Table 4."""

    friction_quadratic: Annotated[float, SI("N s^2/m^2", "quadratic friction a_1", "Table 4")]
    friction_linear: Annotated[float, SI("N s/m", "linear friction a_2", "Table 4, errata E12")]
    friction_coulomb: Annotated[float, SI("N", "Coulomb friction a_3", "Table 4")]


LEAKAGE_COEFFICIENTS = tuple(field.name for field in fields(LeakageLevel))
FRICTION_COEFFICIENTS = tuple(field.name for field in fields(FrictionLevel))
"""Names of the coefficients that friction changes; `LEAKAGE_COEFFICIENTS` are those that leakage changes."""

LEAKAGE_TABLE: Mapping[Level, LeakageLevel] = {
    "none": LeakageLevel(leakage_coefficient=4.784e-12, flow_bias=2.413e-6),
    "minor": LeakageLevel(leakage_coefficient=2.523e-11, flow_bias=1.382e-5),
    "major": LeakageLevel(leakage_coefficient=6.006e-11, flow_bias=1.465e-5),
}
"""Table 3, by leakage level."""

FRICTION_TABLE: Mapping[Level, FrictionLevel] = {
    "none": FrictionLevel(friction_quadratic=6.589e4, friction_linear=2.144e3, friction_coulomb=436.0),
    "minor": FrictionLevel(friction_quadratic=1.162e6, friction_linear=-7.440e3, friction_coulomb=500.0),
    "major": FrictionLevel(friction_quadratic=4.462e6, friction_linear=1.863e4, friction_coulomb=551.0),
}
"""Table 4, by friction level."""


@dataclass(frozen=True)
class Condition:
    """A working condition of Table 1: a level of leakage and a level of friction.

    Raises
    ------
    HydrostateError
        If a level is unknown.
    """

    name: str
    leakage: Level
    friction: Level

    def __post_init__(self) -> None:
        for axis, level in (("leakage", self.leakage), ("friction", self.friction)):
            require_known(f"{axis} level", level, LEVELS)


_NINE = (
    Condition("normal", "none", "none"),
    Condition("minor_leakage", "minor", "none"),
    Condition("major_leakage", "major", "none"),
    Condition("minor_friction", "none", "minor"),
    Condition("major_friction", "none", "major"),
    Condition("minor_leakage_minor_friction", "minor", "minor"),
    Condition("major_leakage_minor_friction", "major", "minor"),
    Condition("minor_leakage_major_friction", "minor", "major"),
    Condition("major_leakage_major_friction", "major", "major"),
)

CONDITIONS: Mapping[str, Condition] = MappingProxyType({condition.name: condition for condition in _NINE})
"""The nine conditions by name, in the order of Table 1."""


def find_condition(name: str) -> Condition:
    """Return the condition of this name.

    Parameters
    ----------
    name : str
        One of `CONDITIONS`.

    Raises
    ------
    HydrostateError
        If there is none of this name.

    Examples
    --------
    >>> find_condition("minor_leakage").leakage
    'minor'
    """
    require_known("condition", name, CONDITIONS)
    return CONDITIONS[name]


def parameters_for(condition: Condition, base: EhaParameters = PAPER_RIG) -> EhaParameters:
    """Return the actuator in a condition: Tables 3 and 4 on the paper's rig, an equivalent change on any other.

    Returns
    -------
    EhaParameters
        The base with its leakage, flow bias and friction changed as `severity` describes.

    Examples
    --------
    >>> parameters_for(CONDITIONS["major_friction"]).friction_quadratic
    4462000.0
    """
    return severity(LEVELS.index(condition.leakage), LEVELS.index(condition.friction), base)


def severity(leakage: float, friction: float, base: EhaParameters = PAPER_RIG) -> EhaParameters:
    """Return the actuator at a continuous severity of leakage and of friction: 0 is none, 1 minor, 2 major.

    Every coefficient is interpolated linearly between the rows of Tables 3 and 4 and extrapolated beyond the last, so
    that friction force and lost flow rise with severity at every velocity and pressure, although a_2 alone dips (errata
    E12).

    A base that is not the paper's rig keeps its own values at 0. The tables' increments over "none" are added, scaled
    to have the same meaning: section 3 defines leakage by the share of velocity it costs and friction by the share of
    pressure it adds, both in the normal state at rated speed. So flow bias scales with the rated pump flow ``Q = D_p *
    rated_speed``, the leakage coefficient with ``Q / p``, and friction with ``p A`` at the same share of the ideal
    velocity ``v = Q / A``: a_1 with ``p A / v^2``, a_2 with ``p A / v``, a_3 with ``p A``, where p is the differential
    pressure at which the healthy actuator settles, all relative to the paper's rig.

    Parameters
    ----------
    leakage, friction : float
        Severities [dimensionless], 0 to `HIGHEST_SEVERITY`.
    base : EhaParameters
        The healthy actuator.

    Raises
    ------
    HydrostateError
        If a severity is not between 0 and `HIGHEST_SEVERITY`.

    Examples
    --------
    >>> round(severity(0.5, 0.0).leakage_coefficient, 15)
    1.5007e-11
    """
    _require_severity("leakage severity", leakage)
    _require_severity("friction severity", friction)
    return _at_severity(leakage, friction, base)


@lru_cache(maxsize=256)
def _at_severity(leakage: float, friction: float, base: EhaParameters) -> EhaParameters:
    """Return the actuator described by `severity`; cached, since a batch requests the same nine with every log."""
    leaking = _with_increments(base, LEAKAGE_TABLE, leakage, leakage_scales(base))
    rubbing = _with_increments(base, FRICTION_TABLE, friction, friction_scales(base))
    return replace(base, **leaking, **rubbing)


def _with_increments(
    base: EhaParameters,
    table: Mapping[Level, LeakageLevel] | Mapping[Level, FrictionLevel],
    amount: float,
    scales: Mapping[str, float],
) -> dict[str, float]:
    """Return the base's coefficients plus the table's scaled increments, exact at every row of the table."""
    if amount == 0.0:
        return {}
    row = min(int(amount), len(LEVELS) - 1)
    upper = min(row + 1, len(LEVELS) - 1)
    healthy, reached, low, high = (asdict(table[LEVELS[i]]) for i in (0, row, upper - 1, upper))
    changed: dict[str, float] = {}
    for name, scale in scales.items():
        faulty = reached[name] + (amount - row) * (high[name] - low[name])
        kept = getattr(base, name) - scale * healthy[name]
        changed[name] = scale * faulty + kept
    return changed


def _require_severity(name: str, value: float) -> None:
    if not (isfinite(value) and 0.0 <= value <= HIGHEST_SEVERITY):
        raise HydrostateError(f"{name} must be between 0 and {HIGHEST_SEVERITY:g}, got {value!r}")
