"""Which faults can be told apart, before any experiment: by structure, and by Kullback-Leibler distance per second."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType

import numpy as np
from scipy.special import ndtr

from estimation.trust.identifiability import CARD_CHANNELS
from faults.conditions import FRICTION_COEFFICIENTS, LEAKAGE_COEFFICIENTS
from faults.eha.bank import mathematical_bank, predict_run
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors, noise_variances

EQUATIONS: Mapping[str, tuple[str, ...]] = {
    "flow balance": ("speed", "position", "velocity", "dp"),
    "force balance": ("velocity", "dp"),
    "kinematics": ("position", "velocity"),
    "motor_speed_rad_s": ("speed",),
    "position_m": ("position",),
    "velocity_m_s": ("velocity",),
    "differential_pressure_pa": ("dp",),
}
"""Equations 5.8 and 5.9 and the sensors, each with the unknowns in it; a rate counts as its state."""

FAULTS: Mapping[str, str] = {
    "leakage": "flow balance",
    "air": "flow balance",
    "friction": "force balance",
    "speed sensor": "motor_speed_rad_s",
    "position sensor": "position_m",
    "velocity sensor": "velocity_m_s",
    "pressure sensor": "differential_pressure_pa",
}
"""The equation that each fault breaks."""

SPREAD: Mapping[str, float] = {
    "bulk_modulus": 0.2,
    **dict.fromkeys((*LEAKAGE_COEFFICIENTS, *FRICTION_COEFFICIENTS), 0.1),
}
"""Relative standard deviations within a class [fraction]."""

MODEL_ERROR = 0.05
"""Error of the lumped plant, as a share of each channel's deviation, judged [fraction]."""

LASTING = 0.05
"""Correlation time of such an error, judged [s]."""

STEP = 1e-3
"""Relative step of the numerical derivatives [fraction]."""

ERROR = 0.01
"""Share of wrong verdicts between two conditions at which they count as told apart [fraction]."""


def structural_isolability(channels: Sequence[str]) -> Mapping[str, tuple[str, ...] | None]:
    """Return the faults from which each fault cannot be told, if a fault may be any signal.

    A fault is detectable if its equation is in the overdetermined part of the model, and isolable from another if it
    stays there after the other's equation is removed (Krysander and Frisk, IEEE Transactions on Systems, Man and
    Cybernetics A 38, 2008, page 197, after Dulmage and Mendelsohn).

    Parameters
    ----------
    channels : sequence of str
        Channels logged besides motor speed.

    Returns
    -------
    Mapping[str, tuple of str or None]
        For each fault, those that it cannot be told from; None if it cannot even be detected. Faults of sensors that
        are not present are left out.

    Examples
    --------
    >>> structural_isolability(["position_m", "velocity_m_s"])["leakage"]
    ('air', 'friction', 'speed sensor')
    >>> structural_isolability(["position_m", "differential_pressure_pa"])["friction"]
    ()
    """
    sensors = {"motor_speed_rad_s", *channels}
    present = {name for name in EQUATIONS if name in sensors or not name.endswith(("_s", "_m", "_pa"))}
    faults = {fault: broken for fault, broken in FAULTS.items() if broken in present}
    whole = overdetermined_equations(present)
    found: dict[str, tuple[str, ...] | None] = {}
    for fault, broken in faults.items():
        if broken not in whole:
            found[fault] = None
            continue
        rivals = (
            (other, overdetermined_equations(present - {removed}))
            for other, removed in faults.items()
            if other != fault
        )
        found[fault] = tuple(other for other, rest in rivals if broken not in rest)
    return MappingProxyType(found)


def overdetermined_equations(equations: set[str]) -> set[str]:
    """Return the equations that can be checked against others: the overdetermined part.

    Parameters
    ----------
    equations : set of str
        Names in `EQUATIONS`.

    Returns
    -------
    set of str
        Those that an alternating path joins, in a maximum matching, to an equation without an unknown of its own.
    """
    owner: dict[str, str] = {}

    def matched(equation: str, tried: set[str]) -> bool:
        for unknown in EQUATIONS[equation]:
            if unknown not in tried:
                tried.add(unknown)
                if unknown not in owner or matched(owner[unknown], tried):
                    owner[unknown] = equation
                    return True
        return False

    ordered = [name for name in EQUATIONS if name in equations]
    reached = {name for name in ordered if not matched(name, set())}
    while grown := {owner[unknown] for name in reached for unknown in EQUATIONS[name]} - reached:
        reached |= grown
    return reached


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances between conditions after an experiment.

    Parameters
    ----------
    nats : ndarray, shape (conditions, conditions)
        Kullback-Leibler distance from the row's condition to the column's class [dimensionless].
    seconds : float
        Length of the experiment [s].
    """

    conditions: tuple[str, ...]
    nats: Array
    seconds: float

    @property
    def mutual(self) -> Array:
        """The smaller distance of the two directions, infinite on the diagonal, shape (conditions, conditions)."""
        both = np.minimum(self.nats, self.nats.T)
        np.fill_diagonal(both, inf)
        return both

    @property
    def hardest(self) -> tuple[str, str]:
        """The two conditions nearest to each other."""
        row, column = np.unravel_index(int(self.mutual.argmin()), self.nats.shape)
        return self.conditions[row], self.conditions[column]

    @property
    def least(self) -> float:
        """The distance between the nearest two conditions [dimensionless], by which drives are ranked."""
        return float(self.mutual.min())


def wrong_verdicts(nats: float) -> float:
    """Return the least share of wrong verdicts between two conditions: ``Phi(-sqrt(K / 2))`` for a distance K.

    Parameters
    ----------
    nats : float
        Kullback-Leibler distance [dimensionless].

    Returns
    -------
    float
        For Gaussian processes of similar covariance, with both conditions equally likely [fraction].

    Examples
    --------
    >>> round(wrong_verdicts(10.8), 3)
    0.01
    """
    return float(ndtr(-((0.5 * nats) ** 0.5)))


def condition_distances(
    parameters: EhaParameters,
    speed: Array,
    sample_time: float,
    channels: Sequence[str] = CARD_CHANNELS,
    sensors: Sensors = BENCH,
) -> Distances:
    """Return the distances between the nine conditions under a drive, each condition being a class of actuators.

    The noiseless run of one condition is fitted as well as another's model can, with bulk modulus, leakage, bias and
    friction moved within `SPREAD` (linearised). Half the weighted sum of squares of the residuals and of the moves is
    the Kullback-Leibler distance. Noise comes from the sensors and from model error (`MODEL_ERROR`): without model
    error, an encoder of a micrometre would tell any two conditions apart in a millisecond. Motor speed's own noise
    moves the position by micrometres and is neglected beside it.

    Parameters
    ----------
    parameters : EhaParameters
        The healthy actuator.
    speed : ndarray, shape (n,)
        Motor speed that would drive it from rest [rad/s].
    sample_time : float
        Time between samples [s].
    channels : sequence of str
        Channels logged besides motor speed.

    Raises
    ------
    HydrostateError
        If a channel is not one of `estimation.trust.identifiability.CARD_CHANNELS`, or has no noise.
    """
    noise = noise_variances(sensors)
    for channel in channels:
        if channel not in CARD_CHANNELS or not noise.get(channel, 0.0) > 0.0:
            raise HydrostateError(
                f"a channel must be one of {', '.join(CARD_CHANNELS)} and have noise, got {channel!r}"
            )
    drive = Record(sample_time, {"motor_speed_rad_s": speed})
    healthy = predict_run(drive, parameters)
    lasting = MODEL_ERROR**2 * max(1.0, LASTING / sample_time)
    sizes = {name: (noise[name] + lasting * float(np.var(healthy[name]))) ** 0.5 for name in channels}

    def seen(model: EhaParameters) -> Array:
        run = predict_run(drive, model)
        return np.concatenate([run[name] / size for name, size in sizes.items()])

    bank = mathematical_bank(parameters)
    runs = {name: seen(model) for name, model in bank.items()}
    distances = np.zeros((len(bank), len(bank)))
    for column, (name, model) in enumerate(bank.items()):
        moves = np.column_stack([_slope(seen, model, runs[name], moved) for moved in SPREAD])
        normal = moves.T @ moves + np.eye(len(SPREAD))
        for row, true in enumerate(runs.values()):
            away = true - runs[name]
            explained = moves.T @ away
            # if both runs are alike, only a rounding error is left, which may be negative
            distances[row, column] = 0.5 * max(away @ away - explained @ np.linalg.solve(normal, explained), 0.0)
    return Distances(tuple(bank), distances, sample_time * len(speed))


def _slope(seen: Callable[[EhaParameters], Array], model: EhaParameters, run: Array, moved: str) -> Array:
    """Return the change of the weighted channels per standard deviation of a parameter."""
    changed = replace(model, **{moved: getattr(model, moved) * (1.0 + STEP)})
    return (seen(changed) - run) * (SPREAD[moved] / STEP)
