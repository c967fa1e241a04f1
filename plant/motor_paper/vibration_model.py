"""The diaphragm-motor paper's linear vibration model, equations 1 to 4, with corrected signs and as printed.

Two masses and three springs: the diaphragms, the fluid and the load at the cylinder (errata M1 to M4, M13). It gives
only the alternating motion and its resonance. It has no valves that rectify the flow, so there is no mean velocity; the
diaphragm-motor plant has one.
"""

from dataclasses import dataclass
from math import pi, sqrt
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.errors import RigError
from plant.motor_paper.fractional import oustaloup_states
from plant.units import require_numbers, si

if TYPE_CHECKING:
    import control

Matrices: TypeAlias = tuple[Array, Array, Array, Array]
"""A, B, C, D of equation 13."""

Signs: TypeAlias = Literal["mended", "printed"]

OUSTALOUP_BAND_HZ, OUSTALOUP_STATES = (1.0, 1e5), 9
"""Band and number of states that approximate a fractional damping in a linear model."""

CALIBRATED = "calibrated: first mode at 480 Hz"


@dataclass(frozen=True, kw_only=True)
class VibrationParameters:
    """Masses, springs and dampers of equations 1 and 2; without cubic spring and fractional damping by default.

    Raises
    ------
    RigError
        If a value is not finite or of the wrong sign, or the order is not from 0 to below 2.
    """

    diaphragm_mass: float = si(1.96e-3, "kg", "mass M_1 of the diaphragms", CALIBRATED)
    cylinder_mass: float = si(3.22e-2, "kg", "mass M_2 of piston and liquid", CALIBRATED)
    diaphragm_stiffness: float = si(
        1.226e6, "N/m", "stiffness k_1 of the diaphragms", "A_c^2/C_d, composite plate of Table 1"
    )
    fluid_stiffness: float = si(3.51e5, "N/m", "stiffness k_2 of fluid and line", "A_c^2/(C_line + V_A/beta), judged")
    load_stiffness: float = si(2e4, "N/m", "stiffness k_3 at the cylinder", "judged", zero=True)
    cubic_stiffness: float = si(0.0, "N/m^3", "cubic spring k_4 at the cylinder, errata M2", "judged")
    damping: float = si(19.4, "N s/m", "viscous damping c", "judged: a tenth of critical", zero=True)
    fractional_damping: float = si(
        0.0, "N/m", "fractional damping c_f, times s to the power of the order, errata M5", "judged"
    )
    fractional_order: float = si(1.0, "1", "order a of the fractional damping, errata M5", "judged", zero=True)

    def __post_init__(self) -> None:
        require_numbers(self)
        if self.fractional_order >= 2.0:
            raise RigError(f"fractional_order must be below 2, which is a mass, got {self.fractional_order!r}")

    @property
    def natural_frequency(self) -> float:
        """First natural frequency without M_1 and damping, equation 4 corrected (errata M4) [Hz]."""
        return sqrt(reduced_stiffness(self) / self.cylinder_mass) / (2.0 * pi)


def reduced_stiffness(
    p: VibrationParameters, equation: Literal["mended", "printed", "printed_1_to_3"] = "mended"
) -> float:
    """Return the linear stiffness on x_2 after x_1 is eliminated, equation 4 (errata M3, M4).

    Parameters
    ----------
    equation : {"mended", "printed", "printed_1_to_3"}
        With restoring springs; as equation 4 prints it; or as it follows from equations 1 to 3 as printed.

    Returns
    -------
    float
        Stiffness [N/m].

    Examples
    --------
    >>> p = VibrationParameters(diaphragm_stiffness=1.0, fluid_stiffness=2.0, load_stiffness=0.1)
    >>> [round(reduced_stiffness(p, name), 3) for name in ("mended", "printed", "printed_1_to_3")]
    [0.767, 2.2, -2.1]
    """
    k1, k2, k3 = p.diaphragm_stiffness, p.fluid_stiffness, p.load_stiffness
    if equation == "mended":
        return k1 * k2 / (k1 + k2) + k3
    if equation == "printed":
        return k2 * (k1 - k3 - k2) / (k1 - k2)
    return (k1 * k2 - k1 * k3 + k2 * k3) / (k1 - k2)


def mechanical_matrices(p: VibrationParameters, signs: Signs = "mended") -> Matrices:
    """Return the state space from force to x_2, without fractional damping (equations 1, 2 and 13, errata M1, M2, M13).

    Parameters
    ----------
    p : VibrationParameters
        Masses, springs, damper.
    signs : {"mended", "printed"}
        Which signs. As printed, equation 1 has ``-k_2 (x_1 - x_2)`` and equation 2 ``-k_3 x_2 - c x_2'``.

    Returns
    -------
    tuple of ndarray
        A of shape (4, 4) on x_1 [m], x_1' [m/s], x_2 [m], x_2' [m/s]; B (4, 1), C (1, 4), D (1, 1).
    """
    M1, M2, k1, k2 = p.diaphragm_mass, p.cylinder_mass, p.diaphragm_stiffness, p.fluid_stiffness
    pull, restoring = (1.0, 1.0) if signs == "mended" else (-1.0, -1.0)
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-(k1 + pull * k2) / M1, 0.0, pull * k2 / M1, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [k2 / M2, 0.0, -(k2 + restoring * p.load_stiffness) / M2, -restoring * p.damping / M2],
        ]
    )
    B = np.array([[0.0], [1.0 / M1], [0.0], [0.0]])
    return A, B, np.array([[0.0, 0.0, 1.0, 0.0]]), np.zeros((1, 1))


def massless_matrices(p: VibrationParameters) -> Matrices:
    """Return the state space of equation 4: without M_1, with corrected signs (errata M3, M4).

    Parameters
    ----------
    p : VibrationParameters
        Mass, springs, damper.

    Returns
    -------
    tuple of ndarray
        A of shape (2, 2) on x_2 [m], x_2' [m/s]; B (2, 1), C (1, 2), D (1, 1).
    """
    M2, k1, k2 = p.cylinder_mass, p.diaphragm_stiffness, p.fluid_stiffness
    A = np.array([[0.0, 1.0], [-reduced_stiffness(p) / M2, -p.damping / M2]])
    B = np.array([[0.0], [k2 / (k1 + k2) / M2]])
    return A, B, np.array([[1.0, 0.0]]), np.zeros((1, 1))


def with_fractional_damping(matrices: Matrices, p: VibrationParameters) -> Matrices:
    """Return a state space with ``-c_f D^a x_2`` on the cylinder's mass, by Oustaloup's states (errata M2, M5).

    Parameters
    ----------
    matrices : tuple of ndarray
        As returned by `mechanical_matrices` or `massless_matrices`: x_2 and x_2' are the last two states.
    p : VibrationParameters
        Damping, order and mass.

    Returns
    -------
    tuple of ndarray
        The same with Oustaloup's states appended; unchanged if there is no fractional damping.
    """
    if p.fractional_damping == 0.0:
        return matrices
    A, B, C, D = matrices
    states = oustaloup_states(p.fractional_order, *OUSTALOUP_BAND_HZ, OUSTALOUP_STATES)
    n, m = A.shape[0], states.B.shape[0]
    source = n - 1 if states.on_velocity else n - 2
    strength = p.fractional_damping / p.cylinder_mass
    wide = np.zeros((n + m, n + m))
    wide[:n, :n], wide[n:, n:] = A, states.A
    wide[n - 1, source] -= strength * states.D
    wide[n - 1, n:] = -strength * states.C
    wide[n:, source] = states.B
    return wide, np.vstack([B, np.zeros((m, 1))]), np.hstack([C, np.zeros((1, m))]), D


def state_space(p: VibrationParameters, *, massless: bool = False, signs: Signs = "mended") -> "control.StateSpace":
    """Return the model as a state space of python-control, from force [N] to displacement x_2 [m], equation 13.

    Parameters
    ----------
    p : VibrationParameters
        The model; its fractional damping becomes Oustaloup's states, its cubic spring is omitted.
    massless : bool
        Whether M_1 is omitted, as in equation 4.
    signs : {"mended", "printed"}
        Which signs; the printed ones only with both masses and without fractional damping.

    Returns
    -------
    control.StateSpace
        For Bode, Nyquist, poles and zeros.
    """
    import control  # slow to import, and few callers need it

    matrices = massless_matrices(p) if massless else mechanical_matrices(p, signs)
    if signs == "mended":
        matrices = with_fractional_damping(matrices, p)
    return control.StateSpace(*matrices, inputs=["force_n"], outputs=["displacement_m"])


def first_mode(poles: NDArray[np.complex128]) -> complex:
    """Return the slowest oscillating pole, with positive frequency.

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
        Poles of a linear model [rad/s].

    Returns
    -------
    complex
        The pole [rad/s].

    Raises
    ------
    RigError
        If nothing oscillates.

    Examples
    --------
    >>> pole = first_mode(np.linalg.eigvals(massless_matrices(VibrationParameters())[0]))
    >>> round(abs(pole) / (2.0 * pi), 1)
    480.0
    """
    swinging = [complex(pole) for pole in poles if pole.imag > 1e-6 * abs(pole)]
    if not swinging:
        raise RigError("the model must oscillate to have a first mode, got real poles only")
    return min(swinging, key=abs)


def exact_response(p: VibrationParameters, frequency: Array) -> NDArray[np.complex128]:
    """Return the response from force to x_2 with the exact fractional damping, ``c_f (i omega)^a`` (errata M2, M5).

    Parameters
    ----------
    p : VibrationParameters
        The model, both masses; its cubic spring is omitted.
    frequency : ndarray, shape (n,)
        Frequencies [Hz].

    Returns
    -------
    ndarray of complex, shape (n,)
        Displacement over force [m/N].
    """
    s = 2j * pi * frequency
    k1, k2 = p.diaphragm_stiffness, p.fluid_stiffness
    first = p.diaphragm_mass * s**2 + k1 + k2
    damper = p.damping * s + p.fractional_damping * s**p.fractional_order
    second = p.cylinder_mass * s**2 + damper + k2 + p.load_stiffness
    return k2 / (first * second - k2**2)
