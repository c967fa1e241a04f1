"""A linear model as python-control objects, JSON and MAT."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from estimation.arrays import Array
from plant.atomic import replacing
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import control

    from estimation.identification.model.linear_model import LinearModel


COVARIANCES = ("covariance", "covariance_white", "covariance_robust")
"""Matrices, in which a number not known is NaN."""


def to_control(model: "LinearModel") -> "control.TransferFunction":
    """Return the model as a python-control object, with sample time and signal names, without dead time in s."""
    import control  # slow to import, and few callers need it

    names = {"inputs": [model.input_name], "outputs": [model.output_name]}
    if model.continuous:
        return control.TransferFunction(model.numerator, model.denominator, **names)
    b, f = _padded(model)
    return control.TransferFunction(b, f, model.sample_time, **names)


def to_ss(model: "LinearModel") -> "control.StateSpace":
    """Return the model as a state space of python-control, in observer form, whose state `initial_state` is."""
    import control
    from scipy.signal import tf2ss

    if model.continuous:
        return control.StateSpace(*tf2ss(model.numerator, model.denominator))
    b, f = _padded(model)
    n = f.size - 1
    A = np.zeros((n, n))
    A[:, :1] = -f[1:, None]
    A[:-1, 1:] = np.eye(max(n - 1, 0))
    C = np.zeros((1, n))
    C[:, :1] = 1.0
    names = {"inputs": [model.input_name], "outputs": [model.output_name]}
    return control.StateSpace(A, (b[1:] - f[1:] * b[0])[:, None], C, [[b[0]]], model.sample_time, **names)


def to_dict(model: "LinearModel") -> dict[str, Any]:
    """Return JSON values at full precision, with None for an unknown number; `from_dict` is the inverse."""
    return {entry: _plain(getattr(model, name)) for name, entry in _ENTRIES.items()}


def to_mat(model: "LinearModel", path: str | Path) -> None:
    """Write the model to a MAT file at full precision and atomically, with one variable for each entry of `to_dict`.

    Parameters
    ----------
    path : str or Path
        The file; ``.mat`` is added to a name without it.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    from scipy.io import savemat

    entries = to_dict(model) | {name: getattr(model, name) for name in COVARIANCES}
    plain = {key: float("nan") if value is None else value for key, value in entries.items()}
    with replacing(Path(path) if str(path).endswith(".mat") else Path(f"{path}.mat")) as file:
        savemat(
            cast(Any, file),
            {key: value if isinstance(value, str) else np.asarray(value) for key, value in plain.items()},
        )


def from_dict(cls: "type[LinearModel]", values: Mapping[str, Any]) -> "LinearModel":
    """Return the model that `to_dict` wrote.

    Parameters
    ----------
    values : Mapping[str, Any]
        As `to_dict` returns, or as read back from JSON; what version 0.1 did not write may be absent.

    Raises
    ------
    HydrostateError
        If an entry is missing, or one is not usable.
    """
    missing = [
        entry for name, entry in _ENTRIES.items() if entry not in values and name not in (*_LATE, *COVARIANCES[1:])
    ]
    if missing:
        raise HydrostateError(f"entry {missing[0]!r} of a linear model is needed, got {', '.join(values)}")
    given: dict[str, Any] = {name: values[entry] for name, entry in _ENTRIES.items() if entry in values}
    given |= {name: float("nan") for name, value in given.items() if value is None}
    return cls(**given)


def _padded(model: "LinearModel") -> list[Array]:
    length = max(model.numerator.size, model.denominator.size)
    return [np.pad(values, (0, length - values.size)) for values in (model.numerator, model.denominator)]


_LATE = (
    "structure",
    "noise_numerator",
    "noise_denominator",
    "continuous",
    "dead_time",
    "dead_time_std",
    "offset",
    "one_step_rmse",
)
_NAMES = (
    *("numerator", "denominator", "sample_time", "input_name", "output_name", "delay", "fit_percent", *COVARIANCES),
    *("initial_state", "rmse", "residual_std", "n_samples", "data_hash", *_LATE),
)
_RENAMED = {"input_name": "input", "output_name": "output", "delay": "delay_samples"} | {
    name: f"{name}_s" for name in ("sample_time", "dead_time", "dead_time_std")
}
_ENTRIES = {name: _RENAMED.get(name, name) for name in _NAMES}
"""Entry of the JSON contract by field, in the contract's order."""


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | list):
        return [_plain(one) for one in list(value)]
    if isinstance(value, float):
        return float(value) if np.isfinite(value) else None
    return value
