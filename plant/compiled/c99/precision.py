"""The two kinds of real numbers for exported C, and the spelling of numbers and functions in each."""

from dataclasses import dataclass
from math import isinf, isnan
from types import MappingProxyType

from plant.errors import require_known


@dataclass(frozen=True)
class Precision:
    """A kind of real number in C.

    Parameters
    ----------
    name : str
        Its type in C.
    literal_suffix, function_suffix : str
        Suffix of a number, and of a function of ``math.h``.
    digits : int
        Digits that reproduce every number of this type [digits].
    """

    name: str
    literal_suffix: str
    function_suffix: str
    digits: int

    def literal(self, value: float) -> str:
        """Return the C literal of a number.

        Parameters
        ----------
        value : float
            The number [any unit].

        Examples
        --------
        >>> DOUBLE.literal(1.0), FLOAT.literal(0.1), DOUBLE.literal(float("inf"))
        ('1.0', '0.1F', 'INFINITY')
        """
        if isnan(value):
            return "NAN"
        if isinf(value):
            return "INFINITY" if value > 0.0 else "-INFINITY"
        text = repr(float(value)) if self.digits == 17 else f"{value:.{self.digits}g}"
        return (text if any(mark in text for mark in ".e") else f"{text}.0") + self.literal_suffix

    def function(self, name: str) -> str:
        """Return the C name of a function of ``math.h``."""
        return name + self.function_suffix


DOUBLE = Precision("double", "", "", 17)
FLOAT = Precision("float", "F", "f", 9)
PRECISIONS = MappingProxyType({one.name: one for one in (DOUBLE, FLOAT)})
"""The precisions, by name."""


def precision_of(name: str) -> Precision:
    """Return a precision by its name.

    Raises
    ------
    HydrostateError
        If it is not known.
    """
    require_known("precision", name, PRECISIONS)
    return PRECISIONS[name]
