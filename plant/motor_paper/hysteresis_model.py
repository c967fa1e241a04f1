"""The diaphragm-motor paper's stack with hysteresis, equations 20 and 21: its loop, and the linearised model.

``m x'' + b x' + k x = k d (u - h)``, where h is the Bouc-Wen hysteresis, in volts (errata M20, M21). For small voltages
h is a fraction of u; at a given amplitude so is its first harmonic, with a phase that does not depend on frequency: the
describing function.
"""

from dataclasses import dataclass
from math import pi, sqrt
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.components.bouc_wen import power_bouc_wen_rate
from plant.errors import RigError
from plant.solvers.steps import rk4_step
from plant.units import require_numbers, si

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, kw_only=True)
class HysteresisParameters:
    """A diaphragm's centre as mass, damper and spring, with hysteresis in volts.

    Raises
    ------
    RigError
        If a value is not finite, mass, damping or stiffness are not positive, or the exponent is below 1.

    Examples
    --------
    >>> round(HysteresisParameters().natural_frequency)
    3985
    """

    mass: float = si(5.2e-4, "kg", "mass m", "judged: a fifth of the diaphragm inside the clamp")
    damping: float = si(0.52, "N s/m", "damping b", "judged: two percent of critical")
    stiffness: float = si(3.26e5, "N/m", "stiffness k", "first mode of Table 1's composite plate, dry")
    stroke_a_volt: float = si(
        8.38e-8, "m/V", "d: displacement a volt without hysteresis", "composite plate", signed=True
    )
    alpha: float = si(0.30, "1", "alpha of equation 21: share of hysteresis at small voltage", "judged", signed=True)
    beta: float = si(
        0.006, "1/V", "beta of equation 21, for exponent 1", "judged: a loop 11 % wide at 100 V", signed=True
    )
    gamma: float = si(0.002, "1/V", "gamma of equation 21, for exponent 1", "judged", signed=True)
    exponent: float = si(1.0, "1", "exponent n of equation 21", "judged", signed=True)

    def __post_init__(self) -> None:
        require_numbers(self)
        if self.exponent < 1.0:
            raise RigError(f"exponent must be at least 1, got {self.exponent!r}")

    @property
    def natural_frequency(self) -> float:
        """Natural frequency, equation 20 [Hz]."""
        return sqrt(self.stiffness / self.mass) / (2.0 * pi)


def hysteresis_loop(
    p: HysteresisParameters,
    amplitude: float,
    frequency: float,
    samples: int = 1000,
    law: Literal["mended", "printed"] = "mended",
) -> tuple[Array, Array]:
    """Return voltage and hysteresis over the fourth cycle of a sine from rest, equation 21 (errata M21).

    Parameters
    ----------
    amplitude : float
        Amplitude of the voltage [V].
    frequency : float
        Its frequency [Hz].
    samples : int
        Steps per cycle.
    law : {"mended", "printed"}
        ``alpha u' - beta abs(u') h abs(h)^(n-1) - gamma u' abs(h)^n``; the printed law has u instead of u' in the first
        and last term.

    Returns
    -------
    tuple of ndarray, each of shape (samples + 1,)
        Voltage [V] and hysteresis [V]; the last sample is the start of the next cycle.

    Examples
    --------
    >>> voltage, hysteresis = hysteresis_loop(HysteresisParameters(), 100.0, 480.0)
    >>> round(loop_area(voltage, hysteresis))
    2069
    """
    angle = 2.0 * pi * np.arange(4 * samples + 1) / samples
    voltage, rate = amplitude * np.sin(angle), 2.0 * pi * frequency * amplitude * np.cos(angle)

    def mended(state: tuple[Scalar, ...], speed: Scalar, _p: object) -> tuple[Scalar, ...]:
        return (power_bouc_wen_rate(speed, state[0], p.alpha, p.beta, p.gamma, p.exponent),)

    step = rk4_step(mended)
    seconds = 1.0 / (frequency * samples)
    hysteresis = np.zeros(angle.shape[0])
    h = 0.0
    for k in range(angle.shape[0] - 1):
        if law == "mended":
            h = step((h,), (rate[k], rate[k + 1]), p, seconds)[0]
        else:
            u, speed = 0.5 * (voltage[k] + voltage[k + 1]), abs(0.5 * (rate[k] + rate[k + 1]))
            yielding = (p.beta * speed + p.gamma * u * np.sign(h)) * abs(h) ** (p.exponent - 1.0)
            h = (h + seconds * p.alpha * u) / (1.0 + seconds * yielding)
        hysteresis[k + 1] = h
    return voltage[-samples - 1 :], hysteresis[-samples - 1 :]


def loop_area(voltage: Array, hysteresis: Array) -> float:
    """Return the area of a closed loop, by trapezia: the heat of equation 20, divided by k d.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Voltage [V].
    hysteresis : ndarray, shape (n,)
        Hysteresis [V].

    Returns
    -------
    float
        Area [V^2].
    """
    return abs(float(np.trapezoid(hysteresis, voltage)))


def describing_function(voltage: Array, hysteresis: Array) -> complex:
    """Return the first harmonic of the hysteresis divided by that of its sinusoidal voltage.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        One cycle [V]; its last sample is the first of the next cycle.
    hysteresis : ndarray, shape (n,)
        The same for the hysteresis [V].

    Returns
    -------
    complex
        Its real part is the fraction in phase with the voltage, its imaginary part times pi a^2 the loop's area.
    """
    return complex(harmonics(hysteresis, 1)[1] / harmonics(voltage, 1)[1])


def harmonics(cycle: Array, count: int, cycles: int = 1) -> NDArray[np.complex128]:
    """Return mean and harmonics of whole cycles of a periodic signal, Figures 19 to 21 and 30.

    Parameters
    ----------
    cycle : ndarray, shape (n,)
        Whole cycles [any unit]; the last sample is the first of the next cycle.
    count : int
        Number of harmonics, the first included.

    Returns
    -------
    ndarray of complex, shape (count + 1,)
        Mean, then amplitudes with phase, in the signal's unit.

    Examples
    --------
    >>> angle = np.linspace(0.0, 2.0 * np.pi, 65)
    >>> np.abs(harmonics(1.0 + 3.0 * np.sin(angle) + 0.5 * np.cos(2.0 * angle), 3)).round(6).tolist()
    [1.0, 3.0, 0.5, 0.0]
    """
    lines = np.fft.rfft(cycle[:-1]) / (cycle.shape[0] - 1)
    found = lines[: count * cycles + 1 : cycles]
    return np.concatenate([found[:1], 2.0 * found[1:]])


def total_harmonic_distortion(lines: NDArray[np.complex128]) -> float:
    """Return the ratio of the higher harmonics to the first, Figure 21.

    Parameters
    ----------
    lines : ndarray of complex, shape (n,)
        Result of `harmonics` [any unit].

    Returns
    -------
    float
        Root of their summed squares over the magnitude of the first [dimensionless].

    Examples
    --------
    >>> total_harmonic_distortion(np.array([0.0, 10.0, 0.3, 0.4], dtype=complex))
    0.05
    """
    return float(np.linalg.norm(lines[2:]) / abs(lines[1]))


def linearised(p: HysteresisParameters) -> "control.TransferFunction":
    """Return the model for small voltages, ``k d (1 - alpha)/(m s^2 + b s + k)``, equation 20 linearised (errata M20).

    Returns
    -------
    control.TransferFunction
        From voltage [V] to displacement [m].
    """
    import control  # slow to import, and few callers need it

    gain = p.stiffness * p.stroke_a_volt * (1.0 - p.alpha)
    names = {"inputs": ["voltage_v"], "outputs": ["displacement_m"]}
    return control.TransferFunction([gain], [p.mass, p.damping, p.stiffness], **names)
