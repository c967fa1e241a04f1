"""Channels of a piezo-stack log with a wrong sign, unit or name, found by comparison with runs of likely actuators."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from math import sqrt

from estimation.arrays import Array
from plant.log.columns import UNITS

LEAST_CORRELATION = 0.9
"""Correlation with a run above which a channel follows that run [dimensionless]. Each fault that is a first guess has
over 0.99 with its own run."""

LARGEST_SIZE_FACTOR = 2.0
"""Factor by which a channel's size may be off because of a fault; more is a wrong unit [dimensionless]. The nearest
wrong units are ten times apart."""

SLIPS: Mapping[str, Mapping[float, str]] = {
    "m": {1e3: "mm", 1e6: "um"},
    "N": {1e-3: "kN"},
    "Pa": {1e-5: "bar", 1e-6: "MPa", 1e-3: "kPa"},
}
"""For each SI unit, the factor by which numbers in another unit differ, and that unit [dimensionless]."""


def channel_mistakes(measured: Mapping[str, Array], runs: Sequence[Mapping[str, Array]]) -> tuple[str, ...]:
    """Return what is wrong with the sign, unit or name of channels, one clause each.

    Every channel follows the drive, so a run of almost any actuator resembles it.

    Parameters
    ----------
    measured : Mapping[str, ndarray of shape (n,)]
        The log's channels [SI].
    runs : sequence of Mapping[str, ndarray of shape (n,)]
        The same channels of likely actuators under the same drive [SI].

    Returns
    -------
    tuple of str
        Empty if each channel agrees with one of the actuators.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.linspace(0.0, 1.0, 100)
    >>> run = {"position_m": 1e-3 * np.sin(9.0 * time), "stack_force_n": 2e3 * np.cos(9.0 * time)}
    >>> channel_mistakes({"position_m": -run["position_m"], "stack_force_n": 1e-3 * run["stack_force_n"]}, [run])
    ('position_m has the opposite sign', 'stack_force_n is in kN')
    """
    swapped = tuple(_swapped_channels(measured, runs))
    return swapped or tuple(_single_channel_mistakes(measured, runs))


def _swapped_channels(measured: Mapping[str, Array], runs: Sequence[Mapping[str, Array]]) -> Iterator[str]:
    for one, other in combinations(measured, 2):
        crossed = _is_near(_relative_size(measured[one], runs, other)) and _is_near(
            _relative_size(measured[other], runs, one)
        )
        if crossed and not (
            _is_near(_relative_size(measured[one], runs, one)) or _is_near(_relative_size(measured[other], runs, other))
        ):
            yield f"{one} and {other} are swapped"


def _single_channel_mistakes(measured: Mapping[str, Array], runs: Sequence[Mapping[str, Array]]) -> Iterator[str]:
    for name, values in measured.items():
        share = _relative_size(values, runs, name)
        unit = next((unit for factor, unit in SLIPS[UNITS[name]].items() if _is_near(abs(share) / factor)), "")
        said = ["has the opposite sign"] if share < 0.0 and (unit or _is_near(-share)) else []
        said += [f"is in {unit}"] if unit else []
        if said:
            yield f"{name} {' and '.join(said)}"


def _relative_size(values: Array, runs: Sequence[Mapping[str, Array]], name: str) -> float:
    """Return a channel relative to that of the run most like it [dimensionless]; 0 if no run is alike."""
    best, share = LEAST_CORRELATION, 0.0
    mine = values - values.mean()
    for run in runs:
        other = run[name] - run[name].mean()
        product, own = float(mine @ other), float(other @ other)
        size = sqrt(float(mine @ mine) * own)
        if abs(product) > best * size:
            best, share = abs(product) / size, product / own
    return share


def _is_near(ratio: float) -> bool:
    return 1.0 / LARGEST_SIZE_FACTOR < ratio < LARGEST_SIZE_FACTOR
