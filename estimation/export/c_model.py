"""An identified linear model in C99: a difference equation from its inputs to its output."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.model import FreeRunModel
from plant.compiled.c99.files import c_files, checked_name
from plant.compiled.c99.precision import precision_of
from plant.errors import HydrostateError

NO_LEVEL = 1e-9
"""Sum of a denominator's coefficients, over that of their magnitudes, below which the model integrates [fraction]."""


def model_in_c(model: FreeRunModel, *, name: str, precision: str = "double") -> dict[str, str]:
    """Return the C99 files of a linear model.

    Parameters
    ----------
    model : FreeRunModel
        A linear model with one input or several.
    name : str
        Name of its files, types and functions: a valid name in C.
    precision : str
        ``double`` or ``float``.

    Returns
    -------
    dict[str, str]
        Texts of ``NAME.h``, ``NAME.c``, ``example.c`` and ``Makefile``, by file name.

    Raises
    ------
    HydrostateError
        If the model is not linear or has limits, C does not allow the name, or the precision is not known.
    """
    require_transfer_function(model)
    real, name = precision_of(precision), checked_name(name)
    both = model.transfer_functions()
    order = max(1, *(max(b.size, f.size) - 1 for b, f in both))
    numerators = [np.pad(b, (0, order + 1 - b.size)) for b, _ in both]
    denominator = np.pad(both[0][1], (0, order + 1 - both[0][1].size))
    integrates = abs(denominator.sum()) < NO_LEVEL * np.abs(denominator).sum()
    gains = [0.0 if integrates else float(b.sum() / denominator.sum()) for b in numerators]

    def spelt(values: Array | list[float]) -> list[str]:
        return [real.literal(float(value)) for value in values]

    facts = {
        "sample_time": model.sample_time,
        "inputs": model.inputs,
        "output": model.output,
        "order": order,
        "operations": (2 * order + 3) * len(numerators) + 3 * order + 2,
        "numerators": [spelt(b) for b in numerators],
        "denominator": spelt(denominator),
        "gains": spelt(gains),
        "means": spelt(model.scaling.u_mean),
        "level": real.literal(model.level),
    }
    return c_files("estimation", "model", name, real, facts)


def require_transfer_function(model: FreeRunModel) -> None:
    """Refuse a model that is more than a transfer function: one with limits of its output, or with an error model.

    Raises
    ------
    HydrostateError
        If it has limits, which are named, or an error model.
    """
    if model.error_model is not None:
        raise HydrostateError(
            f"the model of {model.output!r} has an error model, a polynomial that is not exported: identify with "
            "--structure output-error for a transfer function alone"
        )
    if not isinstance(model.dynamics, LimitedDynamics):
        return
    told = model.dynamics.limits.nonlinearity(model.scaling)
    ends = " and ".join(f"{told[end]['value']:.4g}" for end in ("low", "high") if end in told)
    how = "held by stops" if model.dynamics.limits.stops else "cut off"
    raise HydrostateError(
        f"the output {model.output!r} of this model is {how} at {ends}, and a transfer function alone does not end "
        "there: a model with limits is not exported"
    )
