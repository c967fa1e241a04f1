"""The public benchmark's oscillator, and its parameters from force and displacement (Noël and Schoukens 2016).

A mass on a spring, a damper and a Bouc-Wen force (equations 1 and 2).
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any

import numpy as np

from estimation.piezo_stack.bouc_wen import HysteresisFit, fit_displacement
from estimation.tuning.step_sensitivity import sensitivity_step
from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.components.bouc_wen import bouc_wen_rate
from plant.errors import RigError
from plant.solvers.steps import rk4_step
from plant.solvers.trajectory import compile_trajectory
from plant.units import si

BENCHMARK = "Noël and Schoukens 2016, Table 1"

OVERSAMPLING = 20
"""Integration steps between the benchmark's samples, as its authors used."""


@dataclass(frozen=True, kw_only=True)
class OscillatorParameters:
    """The benchmark's oscillator, ``m y'' + c y' + k y + z = u``; its true values by default.

    Only the products beta gamma and beta delta have an effect, so they are the parameters.

    Raises
    ------
    RigError
        If a value is not finite, or mass, stiffness or alpha are not positive.
    """

    mass: float = si(2.0, "kg", "mass m", BENCHMARK)
    damping: float = si(10.0, "N s/m", "damping c", BENCHMARK)
    stiffness: float = si(5e4, "N/m", "stiffness k", BENCHMARK)
    alpha: float = si(5e4, "N/m", "small-signal stiffness of the Bouc-Wen force", BENCHMARK)
    beta_gamma: float = si(800.0, "1/m", "beta times gamma", BENCHMARK)
    beta_delta: float = si(-1100.0, "1/m", "beta times delta", BENCHMARK)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isfinite(value) or (field.name in ("mass", "stiffness", "alpha") and value <= 0.0):
                raise RigError(f"{field.name} must be finite, and mass, stiffness and alpha positive, got {value!r}")


def oscillator_derivative(state: tuple[Scalar, ...], force: Scalar, p: Any) -> tuple[Scalar, ...]:
    """Return the rates of the benchmark's oscillator. Source: Noël and Schoukens 2016, equations 1 and 2.

    Parameters
    ----------
    state : tuple of float or Expression
        Displacement [m], velocity [m/s], hysteretic force [N].
    force : float or Expression
        Drive u [N].
    p : OscillatorParameters or namespace of Expression
        The oscillator.

    Returns
    -------
    tuple of float or Expression
        Rates per second.

    Examples
    --------
    >>> oscillator_derivative((0.0, 0.0, 1.0), 2.0, OscillatorParameters())
    (0.0, 0.5, 0.0)
    """
    y, v, z = state
    return (
        v,
        (force - p.damping * v - p.stiffness * y - z) / p.mass,
        bouc_wen_rate(v, z, p.alpha, 1.0, p.beta_gamma, p.beta_delta),
    )


oscillator_step = rk4_step(oscillator_derivative)
"""A Runge-Kutta step of the oscillator."""


def fit_oscillator(
    force: Array, displacement: Array, sample_time: float, start: OscillatorParameters, periodic: bool = True
) -> HysteresisFit:
    """Fit all six parameters of the benchmark's oscillator together to force and displacement.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Drive [N], band-limited.
    displacement : ndarray, shape (n,)
        Measured displacement [m].
    sample_time : float
        Seconds between samples [s].
    start : OscillatorParameters
        First guess, as from `linear_start`.
    periodic : bool
        Whether the force is one period of a signal with the oscillator in steady state; otherwise it starts at rest.
    """
    names = [field.name for field in fields(OscillatorParameters)]
    run = _oscillator_run(tuple(names))

    def simulate(theta: Array) -> tuple[Array, Array]:
        states = _settled_run(run, force, sample_time, theta, 3 * (1 + len(names)), periodic)
        return states[:, 0], states[:, 3::3]

    first = np.array([getattr(start, name) for name in names])
    scale = np.abs(first)
    scale[4:] = max(float(scale[4:].max()), 1e2)
    return fit_displacement(simulate, displacement, first, scale, tuple(names))


def simulate_oscillator(
    force: Array, sample_time: float, parameters: OscillatorParameters, periodic: bool = True
) -> Array:
    """Return the benchmark oscillator's displacement.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Drive [N], band-limited.
    sample_time : float
        Seconds between samples [s].
    periodic : bool
        As in `fit_oscillator`.

    Returns
    -------
    ndarray, shape (n,)
        Displacement [m].
    """
    theta = np.array([getattr(parameters, field.name) for field in fields(OscillatorParameters)])
    return _settled_run(_oscillator_run(()), force, sample_time, theta, 3, periodic)[:, 0]


def linear_start(force: Array, displacement: Array, sample_time: float) -> OscillatorParameters:
    """Return a first guess: mass, damping and stiffness by least squares on spectra, the spring shared with hysteresis.

    Parameters
    ----------
    force : ndarray, shape (n,)
        One period of the drive, or a long record of it [N].
    displacement : ndarray, shape (n,)
        Measured displacement [m].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    OscillatorParameters
        First guess from which `fit_oscillator` converges.
    """
    u, y = np.fft.rfft(force), np.fft.rfft(displacement)
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(force), sample_time)
    used = np.abs(u) > 0.1 * np.abs(u).max()
    columns = np.column_stack([-(omega**2) * y, 1j * omega * y, y])[used]
    both = np.concatenate([columns.real, columns.imag])
    size = np.linalg.norm(both, axis=0)
    m, c, k = np.linalg.lstsq(both / size, np.concatenate([u[used].real, u[used].imag]), rcond=None)[0] / size
    swing = float(np.ptp(displacement))
    guess = OscillatorParameters()
    return replace(
        guess,
        mass=abs(m),
        damping=abs(c),
        stiffness=0.6 * abs(k),
        alpha=0.6 * abs(k),
        beta_gamma=1.0 / swing,
        beta_delta=-0.5 / swing,
    )


def _oscillator_run(names: tuple[str, ...]) -> Callable[..., Array]:
    step = sensitivity_step(oscillator_step, 3, names) if names else oscillator_step
    label = "oscillator_slopes" if names else "oscillator"
    return compile_trajectory(label, step, 3 * (1 + len(names)), OscillatorParameters)


def _settled_run(
    run: Callable[..., Array], force: Array, sample_time: float, theta: Array, width: int, periodic: bool
) -> Array:
    """Run on the force, interpolated by its spectrum; a periodic force runs for a second period."""
    from scipy.signal import resample, resample_poly

    fine: Any = (
        resample(force, OVERSAMPLING * len(force))
        if periodic
        else resample_poly(np.append(force, 0.0), OVERSAMPLING, 1)
    )
    drive = np.concatenate([fine[-OVERSAMPLING * _LEAD_IN :], fine, fine[:1]]) if periodic else fine
    states = run(np.zeros(width), np.ascontiguousarray(drive), theta[None], sample_time / OVERSAMPLING, 1)
    first = OVERSAMPLING * _LEAD_IN if periodic else 0
    return states[first : first + OVERSAMPLING * len(force) : OVERSAMPLING]


_LEAD_IN = 750
"""Settling samples before a period: the oscillator decays within 0.4 s."""
