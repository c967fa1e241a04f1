"""ARMAX and Box-Jenkins models: least squares of the one-step prediction, by Levenberg-Marquardt."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task
from estimation.identification.fit.output_error import jacobian_and_residual, minimise
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import Experiments, Signals
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.noise_model import noise_start
from estimation.identification.search.one_step import prediction_errors
from estimation.identification.search.starts import least_squares_arx

MOST_STEPS = 100
"""Evaluations from each start."""

TOLERANCE = 1e-10
"""Share of the cost that a further step may promise at the end."""


@dataclass(frozen=True)
class NoiseStructure:
    """Orders of ``y = B/F u + C/D e``.

    Parameters
    ----------
    system : Structure
        Of ``B/F``.
    n_c, n_d : int
        Coefficients of C and D behind their 1.
    tied : bool
        Whether ``D = F``.
    """

    system: Structure
    n_c: int
    n_d: int
    tied: bool

    @property
    def n_main(self) -> int:
        """Values beside the initial states."""
        return self.system.n_main + self.n_c + self.n_d

    @property
    def sizes(self) -> np.ndarray:
        """As `prediction_errors` takes them."""
        s = self.system
        return np.array([s.n_numerator, s.n_denominator, self.n_c, self.n_d, s.delay, s.n_initial])

    def split(self, theta: Array) -> tuple[Array, Array, Array, Array]:
        """Return numerator with denominator, denominator, C and D, behind their 1.

        Parameters
        ----------
        theta : ndarray, shape (n_main,) or longer
            All values.

        Returns
        -------
        tuple of ndarray
            Shapes (n_b + n_f,), (n_f,), (n_c,) and (n_d,).
        """
        at_c = self.system.n_main
        at_d = at_c + self.n_c
        return theta[:at_c], theta[self.system.n_numerator : at_c], theta[at_c:at_d], theta[at_d : self.n_main]

    def acceptable(self, theta: Array) -> bool:
        """Return whether the predictor is stable: C always, and F and D unless tied, when they cancel out of it.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            All values.

        Returns
        -------
        bool
            False, too, where a value is not finite.
        """
        _, f, c, d = self.split(theta)
        return bool(np.isfinite(theta).all() and stable(c) and (self.tied or (stable(f) and stable(d))))


def fit_armax(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    n_c: int,
    delay: int = 0,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``F y = B u + C e`` by least squares of the one-step prediction.

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing: predicted there.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator, n_c : int
        Free coefficients of B, F and C.
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.
    input_name, output_name : str
        Channel names.

    Returns
    -------
    LinearModel
        ``structure="ARMAX"``, D = F.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    system = Structure(n_numerator, n_denominator, delay)
    task = Task(system, sample_time, covariance, (input_name, output_name), n_c)
    return _fit(NoiseStructure(system, n_c, 0, tied=True), u, y, task, "ARMAX")


def fit_box_jenkins(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    n_c: int,
    n_d: int,
    delay: int = 0,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``y = B/F u + C/D e`` by least squares of the one-step prediction (Box and Jenkins, 1970).

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing: predicted there.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator, n_c, n_d : int
        Free coefficients of B, F, C and D.
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.
    input_name, output_name : str
        Channel names.

    Returns
    -------
    LinearModel
        ``structure="Box-Jenkins"``.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    system = Structure(n_numerator, n_denominator, delay)
    task = Task(system, sample_time, covariance, (input_name, output_name), n_c, n_d)
    return _fit(NoiseStructure(system, n_c, n_d, tied=False), u, y, task, "Box-Jenkins")


def _fit(form: NoiseStructure, u: Signals, y: Signals, task: Task, structure: str) -> LinearModel:
    data = task.experiments(u, y)
    found = [_descend(form, start, data) for start in _starts(form, data)]
    _, theta, error, jacobian = min(found, key=lambda one: one[0])
    main, f, c, d = form.split(theta)
    state = theta[form.n_main : form.n_main + form.system.n_states]
    noise = (np.concatenate([[1.0], c]), np.concatenate([[1.0], f if form.tied else d]))
    return task.model(np.concatenate([main, state]), jacobian, error, data, structure, noise)


def _starts(form: NoiseStructure, data: Experiments) -> list[Array]:
    """Return starts: the output-error model with the noise that it leaves, with none, and from ARX."""
    system, longest = form.system, data.longest
    n_b, n_f = system.n_numerator, system.n_denominator
    output_error = minimise(system, data)
    _, residual = jacobian_and_residual(system, output_error, data)
    main, initial = output_error[: system.n_main], output_error[system.n_main :]
    u, y = data.bridged()[data.slices.index(longest)]
    arx_b, arx_f = least_squares_arx(n_b, n_f, system.delay, u, y)
    arx = np.concatenate([arx_b[system.delay :], arx_f[1:]])
    starts: list[Array] = []
    for values, rest in ((main, initial), (arx, np.zeros_like(initial))):
        noises = [(np.zeros(form.n_c), np.zeros(form.n_d))]
        if values is main and form.n_c + form.n_d:
            f = np.concatenate([[1.0], main[n_b:]])
            v = residual[longest]
            guess = noise_start(np.convolve(v, f)[: v.size] if form.tied else v, form.n_c, form.n_d)
            noises.append((guess[0][1:], guess[1][1:]))
        for c, d in noises:
            start = np.concatenate([values, c, d, rest])
            if form.acceptable(start):
                starts.append(start)
    return starts


def _descend(form: NoiseStructure, start: Array, data: Experiments) -> tuple[float, Array, Array, Array]:
    """Return cost, values, prediction errors and Jacobian of the minimum that one start leads to."""
    n, p = data.u.size, start.size

    def predicted(theta: Array) -> tuple[float, Array, Array]:
        error, jacobian = np.zeros(n), np.zeros((n, p))
        cost = prediction_errors(theta, form.sizes, form.tied, data.u, data.y, data.used, data.bounds, error, jacobian)
        return cost, error, jacobian

    def normal(theta: Array) -> tuple[float, Array, Array]:
        cost, error, jacobian = predicted(theta)
        return cost, jacobian.T @ jacobian, -(jacobian.T @ error)

    cost, theta = levenberg(normal, start, form.acceptable, tolerance=TOLERANCE, most_steps=MOST_STEPS)
    return cost, theta, *predicted(theta)[1:]
