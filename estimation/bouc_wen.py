"""Bouc-Wen parameters from measured loops, by least squares on simulated ones with exact sensitivities.

The paper's own procedure is in `estimation.bouc_wen_printed`; it cannot work (errata P14).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimation.step_sensitivity import sensitivity_step
from plant.bouc_wen import OscillatorParameters, oscillator_step, slow_stack_step
from plant.errors import LogError
from plant.integrate import compile_trajectory
from plant.piezo_stack_parameters import PiezoStackParameters

Array: TypeAlias = NDArray[np.float64]

NORMAL_95 = 1.959963984540054
"""Half width of a 95 % interval over the standard deviation [dimensionless]."""

SHAPE = ("hysteresis", "hysteresis_phi_1", "hysteresis_phi_2", "hysteresis_phi_3", "hysteresis_gamma")
"""The parameters of the loop's shape, equation 1."""

CYCLES = 3
"""Cycles after which a loop has closed."""

OVERSAMPLING = 20
"""Steps between the benchmark's samples, as its authors integrated it."""

_FEWEST = 50
_WORST_CONDITION = 1e6


@dataclass(frozen=True)
class HysteresisFit:
    """Parameters found, with what is known of their errors.

    Parameters
    ----------
    values : Mapping[str, float]
        Estimates by parameter name [SI].
    deviations : Mapping[str, float]
        Standard deviations by parameter name [SI].
    error : float
        Root mean square of the residuals [m].
    evaluations : int
        Simulations that it took.
    condition : float
        Condition number of the scaled Jacobian [dimensionless]; large where parameters cannot be told apart.
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    error: float
    evaluations: int
    condition: float

    def interval(self, name: str) -> tuple[float, float]:
        """Return a parameter's 95 % interval.

        Parameters
        ----------
        name : str
            The parameter.

        Returns
        -------
        tuple of float
            Lower and upper end [SI].
        """
        half = NORMAL_95 * self.deviations[name]
        return self.values[name] - half, self.values[name] + half


def fit_stack_loop(voltage: Array, displacement: Array, *, from_rest: bool = True) -> HysteresisFit:
    """Fit a stack's free stroke a volt and its hysteresis to one slow loop (equation 27 with errata P2, P14).

    Cycles from rest, the first rise among them, tell the parameters apart twenty times better than a closed loop does.
    One cycle from rest alone does not: its hysteresis keeps its sign, and four parameters act as two.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Whole cycles, from trough to trough [V].
    displacement : ndarray, shape (n,)
        Over those cycles [m]; its zero may lie anywhere.
    from_rest : bool
        Whether the stack was without hysteresis at the first sample; else the loop has been gone round before.

    Returns
    -------
    HysteresisFit
        ``free_stroke_a_volt``, the five of `SHAPE`, the displacement's ``offset``, and ``lag``, what the
        stack's lag takes from the displacement a volt a sample [m/V]: a nanometre that would bias the rest.

    Raises
    ------
    LogError
        If the loop is too short, not closed, not finite, or cannot tell the parameters apart.
    """
    u, x = _checked_loop(voltage, displacement)
    step = sensitivity_step(slow_stack_step, 1, SHAPE)
    run = compile_trajectory("slow_stack", step, 1 + len(SHAPE), PiezoStackParameters)  # pyright: ignore[reportArgumentType] - any class of named floats serves
    columns = [field.name for field in fields(PiezoStackParameters)]
    row = np.array([float(field.default) for field in fields(PiezoStackParameters)])  # pyright: ignore[reportArgumentType] - every field has a default
    drive = u if from_rest else np.concatenate([np.tile(u[:-1], CYCLES), u[-1:]])

    def simulate(theta: Array) -> tuple[Array, Array]:
        row[[columns.index(name) for name in SHAPE]] = theta[1:6]
        states = run(np.zeros(6), drive, row[None], 1.0, 1)[-len(u) :]
        slopes = np.column_stack([u, -states[:, 1:], np.ones(len(u)), -rate])
        return theta[0] * u - states[:, 0] + theta[6] - theta[7] * rate, slopes

    rate = np.gradient(u)
    stroke = float(np.ptp(x) / np.ptp(u))
    start = np.array([1.2 * stroke, 0.2 * stroke, 1.0 / np.ptp(u), 0.0, 0.0, 0.0, float(x.min()), 0.0])
    scale = np.array([stroke, stroke, *[1.0 / np.ptp(u)] * 4, float(np.ptp(x)), stroke])
    fit = _fitted(simulate, x, start, scale, ("free_stroke_a_volt", *SHAPE, "offset", "lag"))
    if fit.condition > _WORST_CONDITION:
        raise LogError("the loop cannot tell the hysteresis' parameters apart, wanted two cycles or more from rest")
    return fit


def _checked_loop(voltage: Array, displacement: Array) -> tuple[Array, Array]:
    u, x = (np.ascontiguousarray(values, dtype=np.float64) for values in (voltage, displacement))
    if u.shape != x.shape or u.ndim != 1 or len(u) < _FEWEST:
        raise LogError(f"a loop must have {_FEWEST} samples or more of both, got {u.shape} and {x.shape}")
    if not (np.all(np.isfinite(u)) and np.all(np.isfinite(x))):
        raise LogError("a loop must be finite, got samples that are not")
    gap = abs(float(u[-1] - u[0])) / max(float(np.ptp(u)), 1e-300)
    if gap > 0.02:
        raise LogError(f"a loop must end at the voltage where it began, got a gap of {100.0 * gap:.1f} % of its swing")
    return u, x


def fit_oscillator(
    force: Array, displacement: Array, sample_time: float, start: OscillatorParameters, periodic: bool = True
) -> HysteresisFit:
    """Fit the benchmark's oscillator to force and displacement, all six parameters together.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Drive [N], band-limited.
    displacement : ndarray, shape (n,)
        Measured displacement [m].
    sample_time : float
        Seconds between samples [s].
    start : OscillatorParameters
        First guess, as `linear_start` gives it.
    periodic : bool
        Whether the force is one period of a signal on which the oscillator has settled; else it starts at rest.

    Returns
    -------
    HysteresisFit
        The six parameters.
    """
    names = [field.name for field in fields(OscillatorParameters)]
    run = _oscillator_run(tuple(names))

    def simulate(theta: Array) -> tuple[Array, Array]:
        states = _settled_run(run, force, sample_time, theta, 3 * (1 + len(names)), periodic)
        return states[:, 0], states[:, 3::3]

    first = np.array([getattr(start, name) for name in names])
    scale = np.abs(first)
    scale[4:] = max(float(scale[4:].max()), 1e2)
    return _fitted(simulate, displacement, first, scale, tuple(names))


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
    parameters : OscillatorParameters
        The oscillator.
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
        A guess from which `fit_oscillator` converges.
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
    return compile_trajectory(label, step, 3 * (1 + len(names)), OscillatorParameters)  # pyright: ignore[reportArgumentType] - any class of named floats serves


def _settled_run(
    run: Callable[..., Array], force: Array, sample_time: float, theta: Array, width: int, periodic: bool
) -> Array:
    """Run on the force, interpolated by its spectrum; where it is periodic, a second time round."""
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
"""Samples before a period begins, in which the oscillator settles: it decays within 0.4 s."""


def _fitted(
    simulate: Callable[[Array], tuple[Array, Array]],
    measured: Array,
    start: Array,
    scale: Array,
    names: Sequence[str],
) -> HysteresisFit:
    size = float(np.std(measured))
    last: dict[bytes, tuple[Array, Array]] = {}

    def at(theta: Array) -> tuple[Array, Array]:
        key = theta.tobytes()
        if key not in last:
            last.clear()
            last[key] = simulate(theta * scale)
        return last[key]

    solution = least_squares(
        lambda theta: (at(theta)[0] - measured) / size,
        start / scale,
        lambda theta: at(theta)[1] * scale / size,
        method="lm",
        xtol=1e-10,
        ftol=1e-10,
    )
    slopes = np.asarray(solution.jac)
    residuals = size * solution.fun
    freedom = len(measured) - len(start)
    variance = float(solution.fun @ solution.fun) / freedom
    deviations = scale * np.sqrt(variance * np.diag(np.linalg.pinv(slopes.T @ slopes)))
    error = float(np.sqrt(np.mean(residuals**2)))
    return HysteresisFit(
        MappingProxyType(dict(zip(names, (scale * solution.x).tolist(), strict=True))),
        MappingProxyType(dict(zip(names, deviations.tolist(), strict=True))),
        error,
        int(solution.nfev),
        float(np.linalg.cond(slopes / np.linalg.norm(slopes, axis=0))),
    )
