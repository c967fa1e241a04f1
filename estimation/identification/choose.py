"""Chooses order, delay and structure from the data, and returns the table behind the choice."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.design.dead_time import estimate_delay
from estimation.identification.fit.arx import fit_arx
from estimation.identification.fit.continuous import fit_continuous
from estimation.identification.fit.fitted import CovarianceKind
from estimation.identification.fit.instrumental import fit_instrumental
from estimation.identification.fit.order import order_table
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.fit.prediction_error import fit_armax, fit_box_jenkins
from estimation.identification.fit.subspace import fit_subspace
from estimation.identification.fit.validate import fit_percent, validate
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.experiments import Signals, signal_list
from estimation.identification.structure_names import StructureName
from plant.errors import HydrostateError, LogWarning

if TYPE_CHECKING:
    import pandas as pd

STRUCTURES: tuple[StructureName, ...] = ("ARX", "ARMAX", "output-error", "Box-Jenkins")
"""The four of section 4."""

HELD_BACK = 1.0 / 3.0
"""Share of the record that structures are compared on, and not fitted to."""

NOISE_ORDER = 2
"""Most coefficients of C and of D."""

LEAST = 200
"""A shorter record is compared on itself."""


@dataclass(frozen=True, eq=False)
class Choice:
    """A model, and the scores by which its order and structure were chosen.

    Parameters
    ----------
    orders : pandas.DataFrame or None
        As `order_table`; None where the order was given.
    structures : pandas.DataFrame or None
        Indexed by structure: ``fit_percent`` of the free run and ``one_step_percent`` on the part held back,
        ``whiteness`` and ``cross_correlation`` p-values on the part fitted. None where one structure was given.
    """

    model: LinearModel
    orders: "pd.DataFrame | None"
    structures: "pd.DataFrame | None"


def choose_model(
    u: ArrayLike,
    y: ArrayLike,
    sample_time: float,
    *,
    orders: Sequence[int] = (1, 2, 3, 4),
    delay: int | None = 0,
    structures: Sequence[StructureName] = STRUCTURES,
    n_numerator: int | None = None,
    covariance: CovarianceKind = "auto",
    input_name: str = "input",
    output_name: str = "output",
) -> Choice:
    """Fit every structure at the order that BIC prefers, and return the best free run on held-back data.

    Orders at which a zero nearly cancels a pole are skipped if there are others.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input, no gaps; output, NaN where missing.
    sample_time : float
        Seconds between samples [s].
    orders : sequence of int
        Orders compared; one is taken as given.
    delay : int or None
        Dead time [samples]; None estimates it.
    n_numerator : int, optional
        Numerator coefficients; one more than the order, or as many behind a delay, unless told.
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.

    Raises
    ------
    HydrostateError
        If a structure is not known, or as the fits.
    """
    unknown = [name for name in structures if name not in _FITS]
    if unknown or not structures:
        got = ", ".join(map(repr, unknown)) or "none"
        raise HydrostateError(f"structures must be among {', '.join(_FITS)}, got {got}")
    if not orders:
        raise HydrostateError("orders must be one whole number or more, got none")
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    lag = estimate_delay(inputs, outputs) if delay is None else delay
    order, table, compared = orders[0], None, None
    if len(orders) > 1:
        table = order_table(inputs, outputs, sample_time, orders=tuple(orders), delay=lag)
        # a pole that a zero nearly cancels fits a nonlinearity or drift; it does not show the order
        clean = table[table["cancellations"] == 0]
        kept = table if clean.empty else clean
        order = int(kept.index[int(np.argmin(kept["bic"]))])
    n_b = (order + (1 if lag == 0 else 0)) if n_numerator is None else n_numerator
    form = {"n_numerator": n_b, "n_denominator": order, "delay": lag, "covariance": covariance}
    form |= {"input_name": input_name, "output_name": output_name}
    best: str = structures[0]
    if len(structures) > 1:
        compared = compare_structures(inputs, outputs, sample_time, form, structures)
        best = str(compared["fit_percent"].idxmax())
    return Choice(fit_structure(best, inputs, outputs, sample_time, form), table, compared)


def compare_structures(
    u: Signals, y: Signals, sample_time: float, form: dict[str, Any], structures: Sequence[str]
) -> "pd.DataFrame":
    """Return the scores of structures of one size on the last third of the data, after a fit to the rest.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input and output.
    sample_time : float
        Seconds between samples [s].
    form : dict
        Sizes and names, as the fits take them.

    Returns
    -------
    pandas.DataFrame
        As `Choice.structures`.
    """
    fitted, kept = split_record(u, y)
    rows: dict[str, dict[str, float]] = {}
    for name in structures:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogWarning)
            model = fit_structure(name, *fitted, sample_time, form)
        if not model.is_stable:
            rows[name] = {"fit_percent": float("-inf"), "one_step_percent": float("nan")}
            continue
        found = [validate(model, one_u, one_y) for one_u, one_y in zip(*kept, strict=True)]
        own = validate(model, fitted[0][0], fitted[1][0], fitted=name == "output-error")
        ahead = [fit_percent(one_y, model.predict(one_u, one_y)) for one_u, one_y in zip(*kept, strict=True)]
        rows[name] = {
            "fit_percent": float(np.mean([one.fit_percent for one in found])),
            "one_step_percent": float(np.mean(ahead)),
            "whiteness": own.whiteness.p_value,
            "cross_correlation": own.cross_correlation.p_value,
        }
    import pandas as pd

    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("structure")


def held_back_percent(model: LinearModel, u: Array, y: Array) -> float | None:
    """Return the fit on the last third of a log, of a model with the same structure and size fitted to the rest.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input, no gaps, and output, NaN where missing.

    Returns
    -------
    float or None
        Fit of the free run [%], negative infinity if it is unstable; None of a log shorter than `LEAST` samples.
    """
    if u.size < LEAST:
        return None
    late = model.delay if not model.continuous else round(model.dead_time / model.sample_time) + bool(model.dead_time)
    form = {"n_numerator": model.free_numerator.size, "n_denominator": model.denominator.size - 1, "delay": late}
    form |= {"covariance": "white", "input_name": model.input_name, "output_name": model.output_name}
    table = compare_structures(u, y, model.sample_time, form, (model.structure,))
    return float(table["fit_percent"].iloc[0])


def split_record(u: Signals, y: Signals) -> tuple[tuple[list[Array], list[Array]], tuple[list[Array], list[Array]]]:
    """Return the data to fit and to hold back: the last third of the experiments, or of each of one or two.

    Parameters
    ----------
    u, y : array_like of shape (n,), or a sequence of them
        Input and output. Of two experiments one shorter than `LEAST` samples is fitted alone; where all are, they are
        compared on themselves.

    Returns
    -------
    tuple of tuple of list of ndarray
        Inputs and outputs fitted, inputs and outputs held back.
    """
    inputs, outputs = signal_list(u), signal_list(y)
    if len(inputs) > 2:
        cut = len(inputs) - max(1, round(HELD_BACK * len(inputs)))
        return (inputs[:cut], outputs[:cut]), (inputs[cut:], outputs[cut:])
    long = [one.size >= LEAST for one in inputs]
    if not any(long):
        return (inputs, outputs), (inputs, outputs)
    cuts = [int(one.size * (1.0 - HELD_BACK)) if enough else one.size for one, enough in zip(inputs, long, strict=True)]

    def early(series: list[Array]) -> list[Array]:
        return [one[:cut] for one, cut in zip(series, cuts, strict=True)]

    def late(series: list[Array]) -> list[Array]:
        return [one[cut:] for one, cut in zip(series, cuts, strict=True) if cut < one.size]

    return (early(inputs), early(outputs)), (late(inputs), late(outputs))


def fit_structure(name: str, u: Signals, y: Signals, sample_time: float, form: dict[str, Any]) -> LinearModel:
    """Fit a structure by its name.

    Parameters
    ----------
    name : str
        One of `STRUCTURES`, SRIV, subspace or continuous.
    u, y : array_like of shape (n,), or a sequence of them
        Input and output.
    sample_time : float
        Seconds between samples [s].
    form : dict
        Sizes and names, as the fits take them; a noise model has as many coefficients as F, `NOISE_ORDER` at most.
    """
    noise = min(form["n_denominator"], NOISE_ORDER)
    return _FITS[name](u, y, sample_time, **form, **dict.fromkeys(_NOISE.get(name, ()), noise))


def _subspace(
    u: Signals, y: Signals, sample_time: float, *, n_denominator: int, input_name: str, output_name: str, **_: Any
) -> LinearModel:
    names = {"input_name": input_name, "output_name": output_name}
    return fit_subspace(signal_list(u)[0], signal_list(y)[0], sample_time, order=n_denominator, **names).model


def _continuous(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_denominator: int,
    delay: int,
    input_name: str,
    output_name: str,
    covariance: CovarianceKind,
    estimate_offset: bool = False,
    **_: Any,
) -> LinearModel:
    """Fit a strictly proper model. With a held input, its output responds one sample late even without dead time."""
    about: dict[str, Any] = {"input_name": input_name, "output_name": output_name, "covariance": covariance}
    about["estimate_offset"] = estimate_offset
    late, n = max(delay - 1, 0) * sample_time, n_denominator
    return fit_continuous(u, y, sample_time, n_zeros=n - 1, n_poles=n, dead_time=late, **about)


_FITS: dict[str, Callable[..., LinearModel]] = {
    "ARX": fit_arx,
    "ARMAX": fit_armax,
    "output-error": fit_output_error,
    "Box-Jenkins": fit_box_jenkins,
    "SRIV": fit_instrumental,
    "subspace": _subspace,
    "continuous": _continuous,
}

_NOISE = {"ARMAX": ("n_c",), "Box-Jenkins": ("n_c", "n_d")}
"""Sizes of a noise model that a structure takes."""
