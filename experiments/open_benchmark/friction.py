"""Friction of spring-loaded blocks (Iwan, J. Appl. Mech. 33, 1966): each sticks until its spring is stretched enough.

The model remembers every reversal without rate equations of its own; while all blocks slip, the friction is the
condition's steady curve.
"""

import math

from experiments.open_benchmark.machine import Machine
from plant.arrays import Array

SLIPS = (0.25, 0.6, 1.15, 2.0)
"""Stretch at which each block slips, in units of `Machine.presliding`; all blocks carry equal shares."""

MICRO_DAMPING = 0.3
"""Damping of the blocks that stick, as a share of critical damping [dimensionless]."""


def update_stretch(stretch: Array, moved: float, m: Machine, out: Array) -> None:
    """Write the stretch of the springs after the piston moved.

    Parameters
    ----------
    stretch, out : ndarray, shape (4,)
        Stretch before and after [m].
    moved : float
        Displacement of the piston [m].
    """
    for i in range(len(SLIPS)):
        most = SLIPS[i] * m.presliding
        out[i] = min(max(stretch[i] + moved, -most), most)


def steady_friction(speed: float, viscosity: float, m: Machine) -> tuple[float, float]:
    """Return the forces of blocks and oil film in steady sliding [N]; their sum is a_1 v^2 + a_2 v + a_3.

    If a_2 is negative (errata E12), the blocks carry the falling part, down to half of a_3.

    Parameters
    ----------
    speed : float
        Speed of the piston, without sign [m/s].
    viscosity : float
        Viscosity relative to its value at the start [dimensionless].
    """
    blocks = max(m.coulomb + min(m.linear, 0.0) * speed, 0.5 * m.coulomb)
    whole = m.coulomb + (m.linear * viscosity + m.quadratic * speed) * speed
    return blocks, whole - blocks


def friction_force(velocity: float, stretch: Array, viscosity: float, rough: float, m: Machine) -> float:
    """Return the friction force [N].

    Parameters
    ----------
    velocity : float
        Velocity of the piston [m/s].
    stretch : ndarray, shape (4,)
        Stretch of the springs [m].
    viscosity, rough : float
        Viscosity and grip of the blocks relative to their values at the start [dimensionless].
    """
    blocks, film = steady_friction(abs(velocity), viscosity, m)
    share, sticking = 0.0, 0.0
    for i in range(len(SLIPS)):
        part = stretch[i] / (SLIPS[i] * m.presliding)
        share += part / len(SLIPS)
        if abs(part) < 1.0:
            sticking += 1.0 / (len(SLIPS) * SLIPS[i])
    spring = sticking * m.coulomb / m.presliding
    damping = 2.0 * MICRO_DAMPING * math.sqrt(spring * m.mass)
    return rough * blocks * share + damping * velocity + math.copysign(film, velocity)
