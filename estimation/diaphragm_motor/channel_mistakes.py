"""Channels of a diaphragm motor's log with a wrong sign, unit or name: what each mistake does to the signature.

Each turns, scales or exchanges some of the 29 numbers, and does nothing else. So a log with a mistake is tried with
each of them taken back; if a motor explains what one of these gives, that mistake is named.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from estimation.diaphragm_motor.signature import DRIVE, POSITION, Signature
from plant.arrays import Floats
from plant.diaphragm_motor.run import ELECTRODES

SMALLER_UNITS = {"mm": 1e-3, "um": 1e-6}
"""Units in which an encoder may be logged without saying so, and their size [m]."""

_COUNT = len(ELECTRODES)
_LENGTH = 4 * _COUNT + 1


@dataclass(frozen=True)
class Mistake:
    """A wrong sign, unit or name of one or two channels.

    Parameters
    ----------
    said : str
        The mistake, as a clause.
    order : ndarray, shape (29,)
        Place in the log's signature of each number of the true one.
    factors : ndarray, shape (29,)
        True numbers over those [dimensionless].
    """

    said: str
    order: NDArray[np.intp]
    factors: Floats

    def taken_back(self, seen: Signature) -> Signature:
        """Return the signature that a log would have without the mistake.

        Parameters
        ----------
        seen : Signature
            That of the log.
        """
        covariance = seen.covariance[np.ix_(self.order, self.order)] * np.outer(self.factors, self.factors)
        return replace(seen, values=self.factors * seen.values[self.order], covariance=covariance)


def mistakes_that_explain(seen: Signature, explained: Callable[[Signature], bool]) -> tuple[str, ...]:
    """Return the mistakes without which a motor explains a log.

    Parameters
    ----------
    seen : Signature
        That of a log that no motor explains.
    explained : callable
        Whether a motor explains a signature.

    Returns
    -------
    tuple of str
        A clause each; empty if there is none.
    """
    return tuple(one.said for one in _mistakes() if explained(one.taken_back(seen)))


def _mistakes() -> Iterator[Mistake]:
    as_logged, ones = np.arange(_LENGTH), np.ones(_LENGTH)

    def scaled(said: str, places: slice | int, factor: float) -> Mistake:
        factors = ones.copy()
        factors[places] = factor
        return Mistake(said, as_logged, factors)

    for place, name in enumerate(ELECTRODES):
        yield scaled(f"{name} has the opposite sign", slice(place, 4 * _COUNT, _COUNT), -1.0)
    yield scaled("all electrodes have the opposite sign", slice(4 * _COUNT), -1.0)
    yield scaled("all electrodes are in mV", slice(4 * _COUNT), 1e-3)
    # the phase of the drive is that of the first harmonic; the second one turns by twice as much
    yield scaled(f"{DRIVE} has the opposite sign", slice(2 * _COUNT), -1.0)
    yield scaled(f"{POSITION} has the opposite sign (or the valve retracts: spool = -1)", -1, -1.0)
    for unit, size in SMALLER_UNITS.items():
        yield scaled(f"{POSITION} is in {unit}", -1, size)
    for one, other in combinations(range(_COUNT), 2):
        order = as_logged.copy()
        blocks = _COUNT * np.arange(4)
        order[blocks + one], order[blocks + other] = blocks + other, blocks + one
        yield Mistake(f"{ELECTRODES[one]} and {ELECTRODES[other]} are swapped", order, ones)
