"""Equation 4 of the diaphragm-motor paper in time, with its cubic spring and a fractional damping with memory.

M_1 is omitted and signs are corrected (errata M2 to M5). The step is semi-implicit: springs at the old position,
damping at the new velocity; at order 1 the fractional damper equals the viscous one to the last digits.
"""

from functools import cache

import numpy as np

from plant.arrays import Array
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.motor_paper.fractional import fractional_history, fractional_push, gl_weights
from plant.motor_paper.vibration_model import VibrationParameters, reduced_stiffness


def forced_vibration(
    force: Array,
    start: float,
    speed: float,
    constants: tuple[float, float, float, float, float],
    weights: Array,
    h: float,
) -> tuple[Array, Array]:
    """Return displacement and velocity; the loop of `vibration_run`, which compiles it.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Force on the cylinder [N].
    start, speed : float
        Displacement and velocity at the first sample [m], [m/s].
    constants : tuple (float; float; float; float; float)
        Mass [kg], stiffness [N/m], cubic stiffness [N/m^3], damping [N s/m], and fractional damping over ``h**a``
        [N/m].
    weights : ndarray, shape (m,)
        Weights of `gl_weights` [dimensionless].
    h : float
        Step [s].

    Returns
    -------
    tuple of ndarray, each of shape (n,)
        Displacement [m] and velocity [m/s].
    """
    mass, stiffness, cubic, damping, fractional = constants
    n = force.shape[0]
    displacement, velocity = np.empty(n), np.empty(n)
    ring, newest = np.zeros(2 * (weights.shape[0] - 1)), 0
    x, v = start, speed
    displacement[0], velocity[0] = x, v
    inertia = mass + h * damping + h * h * fractional
    for k in range(1, n):
        remembered = x - start + fractional_history(weights, ring, newest)
        pull = stiffness * x + cubic * x * x * x + fractional * remembered
        v = (mass * v + h * (force[k] - pull)) / inertia
        x = x + h * v
        newest = fractional_push(ring, newest, x - start)
        displacement[k], velocity[k] = x, v
    return displacement, velocity


@cache
def _kernel() -> NativeKernel:
    parts = (
        functions_text(fractional_history, freely=("reassoc", "contract")),
        functions_text(fractional_push, forced_vibration),
    )
    text = kernel_text("forced vibration with cubic spring and fractional damping", *parts)
    return load_native("vibration", text, {"forced_vibration": signature_of(forced_vibration)})


def vibration_run(
    p: VibrationParameters,
    force: Array,
    sample_time: float,
    *,
    start: float = 0.0,
    speed: float = 0.0,
    memory: int | None = None,
) -> tuple[Array, Array]:
    """Return displacement and velocity x_2 and x_2' under a force on the diaphragms, equation 4 corrected (errata M4).

    Parameters
    ----------
    force : ndarray, shape (n,)
        f of equation 1 [N].
    sample_time : float
        Time between samples, equal to the step [s].
    start : float
        Displacement at the first sample; at rest before it [m].
    speed : float
        Velocity at the first sample [m/s]; with an order above 1 it should be zero.
    memory : int, optional
        Number of samples that the fractional damping weights, the newest included; all by default.

    Returns
    -------
    tuple of ndarray, each of shape (n,)
        Displacement [m] and velocity [m/s].
    """
    k1, k2, a = p.diaphragm_stiffness, p.fluid_stiffness, p.fractional_order
    remembered = max(2, min(memory or force.shape[0], force.shape[0])) if p.fractional_damping else 2
    constants = (
        p.cylinder_mass,
        reduced_stiffness(p),
        p.cubic_stiffness,
        p.damping,
        p.fractional_damping / sample_time**a,
    )
    weights = gl_weights(a, remembered)
    return _kernel().forced_vibration(k2 / (k1 + k2) * force, start, speed, constants, weights, sample_time)
