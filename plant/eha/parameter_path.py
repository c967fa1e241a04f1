"""`ParameterPath`: the actuator's parameters over time, for faults that appear and grow."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise
from math import isfinite
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plant.eha.model import EhaParameters
from plant.errors import RigError, require_known

Growth: TypeAlias = Literal["step", "linear"]


@dataclass(frozen=True)
class ParameterPath:
    """Parameters given at several times, and their change between these times.

    The first parameters hold before the first time, and the last ones after the last time.

    Parameters
    ----------
    times : tuple of float
        Increasing times [s].
    parameters : tuple of EhaParameters
        The actuator at each of the times.
    growth : {"step", "linear"}
        ``"step"`` holds each parameter set until the next time; ``"linear"`` interpolates every field.

    Raises
    ------
    RigError
        If the lengths differ, there is no time, the times are not finite and increasing, or the growth is
        unknown.

    Examples
    --------
    >>> path = ParameterPath((1.0, 3.0), (EhaParameters(), EhaParameters(bulk_modulus=1.07e8)), "linear")
    >>> path.sample([0.0, 2.0, 4.0])[:, 4].tolist()
    [207000000.0, 157000000.0, 107000000.0]
    """

    times: tuple[float, ...]
    parameters: tuple[EhaParameters, ...]
    growth: Growth = "step"

    def __post_init__(self) -> None:
        if not self.times or len(self.times) != len(self.parameters):
            raise RigError(
                "a parameter path needs one parameter set a time and at least one, "
                f"got {len(self.times)} times and {len(self.parameters)} parameter sets"
            )
        if not all(isfinite(time) for time in self.times) or any(b <= a for a, b in pairwise(self.times)):
            raise RigError(f"times of a parameter path must be finite and increasing, got {self.times}")
        require_known("growth", self.growth, get_args(Growth), RigError)

    @classmethod
    def constant(cls, parameters: EhaParameters) -> "ParameterPath":
        """Return the path of constant parameters."""
        return cls((0.0,), (parameters,))

    @property
    def is_constant(self) -> bool:
        """Whether all parameter sets are the same."""
        return all(parameters == self.parameters[0] for parameters in self.parameters)

    def sample(self, times: ArrayLike | Sequence[float]) -> NDArray[np.float64]:
        """Return the parameters at some times.

        Parameters
        ----------
        times : array_like, shape (n,)
            Times [s].

        Returns
        -------
        ndarray, shape (n, fields), or (1, fields) when nothing changes
            One row a time, columns in the order of the fields of `EhaParameters`, each in its own SI unit.
        """
        table = np.array([astuple(parameters) for parameters in self.parameters], dtype=np.float64)
        if self.is_constant:
            return table[:1]
        asked = np.asarray(times, dtype=np.float64)
        if self.growth == "step":
            which = np.searchsorted(self.times, asked, side="right") - 1
            return table[np.maximum(which, 0)]
        return np.column_stack([np.interp(asked, self.times, column) for column in table.T])
