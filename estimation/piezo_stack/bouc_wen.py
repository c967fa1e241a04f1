"""Bouc-Wen parameters from measured loops, by least squares on simulated loops with exact sensitivities.

The paper's own procedure is in `estimation.piezo_stack.bouc_wen_printed`; it cannot work (errata P14).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType

import numpy as np
from scipy.optimize import least_squares

from estimation.arrays import Array
from estimation.finding import interval_95
from estimation.tuning.step_sensitivity import sensitivity_step
from plant.errors import LogError
from plant.piezo_stack.hysteresis import slow_stack_step
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.solvers.trajectory import compile_trajectory

SHAPE = ("hysteresis", "hysteresis_phi_1", "hysteresis_phi_2", "hysteresis_phi_3", "hysteresis_gamma")
"""Parameters of the loop's shape, equation 1."""

LOOP = ("free_stroke_a_volt", *SHAPE)
"""Parameters of a stack that a loop determines."""

CYCLES = 3
"""Number of cycles after which a loop has closed."""

_FEWEST = 50
_ENOUGH = 5000
_WORST_CONDITION = 1e6
_TOUCHED = 1e-3


@dataclass(frozen=True)
class HysteresisFit:
    """Parameters found, with estimates of their errors.

    Parameters
    ----------
    values : Mapping[str, float]
        Estimates by parameter name [SI].
    deviations : Mapping[str, float]
        Standard deviations by parameter name [SI].
    error : float
        Root mean square of the residuals [m].
    condition : float
        Condition number of the scaled Jacobian [dimensionless]; large if parameters cannot be told apart.
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    error: float
    evaluations: int
    condition: float

    def interval(self, name: str) -> tuple[float, float]:
        """Return a parameter's 95 % interval.

        Returns
        -------
        tuple of float
            Lower and upper end [SI].
        """
        return interval_95(self.values[name], self.deviations[name])


def fit_stack_loop(voltage: Array, displacement: Array, *, from_rest: bool = True) -> HysteresisFit:
    """Fit a stack's free stroke per volt and its hysteresis to one slow loop (equation 27 with errata P2, P14).

    One loop that has been run through before shows all four sign combinations of rate and hysteresis, and its
    information grows with its samples (`loop_bounds`). Three cycles from rest, including the first rise, give several
    times more. One cycle from rest alone is not enough: in it voltage never rises while hysteresis is negative, so four
    parameters act as three.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Whole cycles, from trough to trough [V].
    displacement : ndarray, shape (n,)
        Displacement over those cycles [m]; its zero is arbitrary.
    from_rest : bool
        Whether the stack had no hysteresis at the first sample; otherwise the loop has been run through before.

    Returns
    -------
    HysteresisFit
        ``free_stroke_a_volt``, the five of `SHAPE`, the displacement's ``offset``, and ``lag``, the displacement that
        the stack's lag removes for each volt per sample [m/V]: a nanometre that would bias the others.

    Raises
    ------
    LogError
        If the loop is too short, not closed, not finite, or cannot tell the parameters apart.
    """
    u, x = _checked_loop(voltage, displacement)
    if not from_rest:
        u, x = (_averaged_loop(values) for values in (u, x))
    stroke = float(np.ptp(x) / np.ptp(u))
    start = np.array([1.2 * stroke, 0.2 * stroke, 1.0 / np.ptp(u), 0.0, 0.0, 0.0, float(x.min()), 0.0])
    scale = np.array([stroke, stroke, *[1.0 / np.ptp(u)] * 4, float(np.ptp(x)), stroke])
    fit = fit_displacement(_loop_model(u, from_rest), x, start, scale, (*LOOP, "offset", "lag"))
    if fit.condition > _WORST_CONDITION:
        raise LogError("the loop cannot tell the hysteresis' parameters apart, wanted two cycles or more from rest")
    return fit


def loop_bounds(
    parameters: PiezoStackParameters, voltage: Array, noise: float, *, from_rest: bool = True
) -> Mapping[str, float]:
    """Return Cramér-Rao bounds of the parameters that `fit_stack_loop` fits to a loop, all unknown together.

    Parameters
    ----------
    voltage : ndarray, shape (n,)
        Whole cycles, from trough to trough [V].
    noise : float
        Standard deviation of the displacement sensor, white [m].
    from_rest : bool
        As in `fit_stack_loop`.

    Returns
    -------
    Mapping[str, float]
        Standard deviation by name, over the parameter's size [dimensionless]; infinite if the loop does not determine
        it.

    Examples
    --------
    >>> voltage = 50.0 * (1.0 - np.cos(2.0 * np.pi * np.arange(5001) / 5000))
    >>> bounds = loop_bounds(PiezoStackParameters(), voltage, 2e-8, from_rest=False)
    >>> round(100.0 * max(bounds.values()), 1)
    2.7
    """
    truth = np.array([float(getattr(parameters, name)) for name in LOOP])
    slopes = _loop_model(voltage, from_rest)(np.append(truth, [0.0, 0.0]))[1]
    size = np.linalg.norm(slopes, axis=0)
    _, told, directions = np.linalg.svd(slopes / size, full_matrices=False)
    lost = told < told[0] / _WORST_CONDITION
    deviations = noise * np.sqrt(np.sum((directions[~lost] / told[~lost, None]) ** 2, axis=0)) / size
    deviations[np.any(np.abs(directions[lost]) > _TOUCHED, axis=0)] = np.inf
    relative = deviations[: len(LOOP)] / np.abs(truth)
    return MappingProxyType(dict(zip(LOOP, relative.tolist(), strict=True)))


def _loop_model(u: Array, from_rest: bool) -> Callable[[Array], tuple[Array, Array]]:
    """Return a slow loop's displacement, and its slopes, as a function of the fitted parameters."""
    step = sensitivity_step(slow_stack_step, 1, SHAPE)
    run = compile_trajectory("slow_stack", step, 1 + len(SHAPE), PiezoStackParameters)
    columns = [field.name for field in fields(PiezoStackParameters)]
    row = np.array([float(field.default) for field in fields(PiezoStackParameters)])  # pyright: ignore[reportArgumentType] - every field has a default
    drive = u if from_rest else np.concatenate([np.tile(u[:-1], CYCLES), u[-1:]])
    rate = np.gradient(u)

    def simulate(theta: Array) -> tuple[Array, Array]:
        row[[columns.index(name) for name in SHAPE]] = theta[1:6]
        states = run(np.zeros(6), drive, row[None], 1.0, 1)[-len(u) :]
        slopes = np.column_stack([u, -states[:, 1:], np.ones(len(u)), -rate])
        return theta[0] * u - states[:, 0] + theta[6] - theta[7] * rate, slopes

    return simulate


def _averaged_loop(values: Array) -> Array:
    """Average a closed loop over neighbours until `_ENOUGH` samples remain: the fit is then many times faster."""
    many = max(1, (len(values) - 1) // _ENOUGH)
    count = (len(values) - 1) // many * many
    means = values[:count].reshape(-1, many).mean(axis=1)
    return np.append(means, means[0])


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


def fit_displacement(
    simulate: Callable[[Array], tuple[Array, Array]],
    measured: Array,
    start: Array,
    scale: Array,
    names: Sequence[str],
) -> HysteresisFit:
    """Fit a simulated displacement to a measured one by the Levenberg-Marquardt method (errata P14).

    Parameters
    ----------
    simulate : callable
        Maps the parameters to the displacement [m], shape (n,), and its slopes by them.
    measured : ndarray, shape (n,)
        Displacement [m].
    start, scale : ndarray, shape (parameters,)
        First guess, and the size of each parameter [SI].
    """
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
