"""A linear model as python-control objects, JSON and MAT."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from estimation.arrays import Array
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import control


COVARIANCES = ("covariance", "covariance_white", "covariance_robust")
"""Matrices, in which a number not known is NaN."""


class Exportable:
    """How a linear model leaves the program, and comes back; the fields are those of `LinearModel`."""

    numerator: Array
    denominator: Array
    sample_time: float
    input_name: str
    output_name: str
    delay: int
    initial_state: Array
    fit_percent: float
    rmse: float
    residual_std: float
    n_samples: int
    data_hash: str
    structure: str
    noise_numerator: Array
    noise_denominator: Array
    continuous: bool
    dead_time: float
    dead_time_std: float

    def to_control(self) -> "control.TransferFunction":
        """Return the model as a python-control object, with sample time and signal names; dead time in s left out."""
        import control  # slow to import, and few callers need it

        names = {"inputs": [self.input_name], "outputs": [self.output_name]}
        if self.continuous:
            return control.TransferFunction(self.numerator, self.denominator, **names)
        b, f = self._padded()
        return control.TransferFunction(b, f, self.sample_time, **names)

    def to_ss(self) -> "control.StateSpace":
        """Return the model as a state space of python-control, in observer form, whose state `initial_state` is."""
        import control
        from scipy.signal import tf2ss

        if self.continuous:
            return control.StateSpace(*tf2ss(self.numerator, self.denominator))
        b, f = self._padded()
        n = f.size - 1
        A = np.zeros((n, n))
        A[:, :1] = -f[1:, None]
        A[:-1, 1:] = np.eye(max(n - 1, 0))
        C = np.zeros((1, n))
        C[:, :1] = 1.0
        names = {"inputs": [self.input_name], "outputs": [self.output_name]}
        return control.StateSpace(A, (b[1:] - f[1:] * b[0])[:, None], C, [[b[0]]], self.sample_time, **names)

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values at full precision, None for a number not known; `from_dict` is the inverse."""
        return {
            "numerator": self.numerator.tolist(),
            "denominator": self.denominator.tolist(),
            "sample_time_s": self.sample_time,
            "input": self.input_name,
            "output": self.output_name,
            "delay_samples": self.delay,
            "fit_percent": _or_none(self.fit_percent),
            **{name: _matrix(getattr(self, name)) for name in COVARIANCES},
            "initial_state": self.initial_state.tolist(),
            "rmse": _or_none(self.rmse),
            "residual_std": _or_none(self.residual_std),
            "n_samples": self.n_samples,
            "data_hash": self.data_hash,
            "structure": self.structure,
            "noise_numerator": self.noise_numerator.tolist(),
            "noise_denominator": self.noise_denominator.tolist(),
            "continuous": self.continuous,
            "dead_time_s": self.dead_time,
            "dead_time_std_s": _or_none(self.dead_time_std),
        }

    def to_mat(self, path: Path) -> None:
        """Write the model to a MAT file at full precision, one variable an entry of `to_dict`.

        Parameters
        ----------
        path : Path
            The file.
        """
        from scipy.io import savemat

        entries = self.to_dict() | {name: getattr(self, name) for name in COVARIANCES}
        plain = {key: float("nan") if value is None else value for key, value in entries.items()}
        savemat(path, {key: value if isinstance(value, str) else np.asarray(value) for key, value in plain.items()})

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the model that `to_dict` wrote.

        Parameters
        ----------
        values : Mapping[str, Any]
            As `to_dict` returns, or as read back from JSON; what version 0.1 did not write may be absent.

        Returns
        -------
        LinearModel
            Equal in every bit.

        Raises
        ------
        HydrostateError
            If an entry is missing, or one is not usable.
        """
        late: dict[str, Any] = {"structure": "", "noise_numerator": [1.0], "noise_denominator": [1.0]}
        late |= {"continuous": False, "dead_time_s": 0.0, "dead_time_std_s": None}
        late |= {"covariance_white": (), "covariance_robust": ()}
        try:
            given = {name: values[entry] for name, entry in _ENTRIES.items() if entry not in late}
        except KeyError as error:
            raise HydrostateError(f"entry {error} of a linear model is wanted, got {', '.join(values)}") from error
        given |= {name: values.get(entry, late[entry]) for name, entry in _ENTRIES.items() if entry in late}
        for name, value in given.items():
            if name in _ARRAYS:
                given[name] = np.array(value, dtype=np.float64)
            elif value is None:
                given[name] = float("nan")
        return cls(**given)

    def _padded(self) -> tuple[Array, Array]:
        length = max(self.numerator.size, self.denominator.size)
        return (
            np.pad(self.numerator, (0, length - self.numerator.size)),
            np.pad(self.denominator, (0, length - self.denominator.size)),
        )


_ARRAYS = ("numerator", "denominator", "initial_state", "noise_numerator", "noise_denominator", *COVARIANCES)

_ENTRIES = {
    **{name: name for name in (*_ARRAYS, "fit_percent", "rmse", "residual_std", "n_samples", "data_hash")},
    "sample_time": "sample_time_s",
    "input_name": "input",
    "output_name": "output",
    "delay": "delay_samples",
    "structure": "structure",
    "continuous": "continuous",
    "dead_time": "dead_time_s",
    "dead_time_std": "dead_time_std_s",
}
"""Entry of the JSON contract by field."""


def _matrix(values: Array) -> list[list[float | None]]:
    return [[_or_none(value) for value in row] for row in values.tolist()]


def _or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None
