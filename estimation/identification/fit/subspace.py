"""Subspace identification (MOESP with past inputs and outputs as instruments), with the order from a noise floor."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.fit.fitted import quality
from estimation.identification.fit.order import order_test
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.search.criterion import Structure, polynomial, profile, stabilised_denominator
from estimation.identification.search.experiments import data_hash, experiments_from
from plant.errors import HydrostateError

BLOCK_ROWS = 15
"""Block rows of past and future; twice the order at least."""


@dataclass(frozen=True, eq=False)
class SubspaceFit:
    """A subspace model, and the singular values behind its order.

    Parameters
    ----------
    model : LinearModel
        The transfer function; subspace methods give no covariance.
    singular_values : ndarray, shape (block rows,)
        Of the weighted projection [output unit].
    noise_floor : float
        Largest such value that noise alone gives [output unit].
    """

    model: LinearModel
    singular_values: Array
    noise_floor: float


def fit_subspace(
    u: ArrayLike,
    y: ArrayLike,
    sample_time: float,
    *,
    order: int | None = None,
    input_name: str = "input",
    output_name: str = "output",
) -> SubspaceFit:
    """Fit a state-space model by PO-MOESP (Verhaegen 1994), without iteration, and give its transfer function.

    The shift structure of the extended observability matrix gives the poles. Least squares on the simulated output then
    gives numerator and initial state.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps.
    sample_time : float
        Seconds between samples [s].
    order : int, optional
        Of the model; the singular values above the noise floor unless told.

    Returns
    -------
    SubspaceFit
        Unstable poles are reflected into the unit circle.

    Raises
    ------
    HydrostateError
        As `fit_output_error`, if an output is missing, or if nothing rises above the noise floor.
    """
    rows = max(BLOCK_ROWS, 2 * (order or 0) + 1)
    given = experiments_from(u, y, (input_name, output_name), n_excited=rows, n_wanted=12 * rows)
    if not given.used.all():
        raise HydrostateError(
            f"a subspace fit needs every sample of {output_name!r}, got {int((~given.used).sum())} missing: "
            "use fit_output_error"
        )
    data = given.scaled()
    left, values = _projected(data.u, data.y, rows)
    test = order_test(data.u, data.y, n_rows=rows)
    n = test.suggested_order if order is None else order
    if n < 1:
        raise HydrostateError(
            f"no singular value of {output_name!r} rises above the noise floor: the input {input_name!r} does not "
            "move it enough for a model"
        )
    shift = np.linalg.lstsq(left[:-1, :n], left[1:, :n], rcond=None)[0]
    f = stabilised_denominator(polynomial(np.linalg.eigvals(shift).astype(np.complex128)), data.u.size)
    form = Structure(n + 1, n)
    theta = profile(form, f, given.u, given.y, given.used)[1]
    b, f, state = form.split(theta)
    residual = given.y - filtered(b, f, given.u, state)
    model = LinearModel(
        numerator=b,
        denominator=f,
        sample_time=sample_time,
        input_name=input_name,
        output_name=output_name,
        initial_state=state,
        data_hash=data_hash(given, sample_time),
        structure="subspace",
        **quality(residual, given, form.n_parameters),
    )
    return SubspaceFit(model, values * data.y_scale, test.projected_noise_floor * data.y_scale)


def _projected(u: Array, y: Array, rows: int) -> tuple[Array, Array]:
    """Return the extended observability matrix's left singular vectors, and the values."""
    width = u.size - 2 * rows + 1

    def block(x: Array, first: int) -> Array:
        return lagged(x, 0, rows)[first + rows - 1 : first + rows - 1 + width, ::-1]

    known = np.concatenate([block(u, rows), block(u, 0), block(y, 0), block(y, rows)], axis=1)
    triangle = np.asarray(np.linalg.qr(known, mode="r"), dtype=np.float64)
    # projection of future outputs, less what future inputs explain, onto the past
    projected = triangle[rows : 3 * rows, 3 * rows :].T / np.sqrt(width)
    left, values, _ = np.linalg.svd(projected, full_matrices=False)
    return left, values
