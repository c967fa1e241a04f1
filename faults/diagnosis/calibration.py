"""Numbers that were fitted on simulated training seeds: weights of the evidences, widths of the intervals.

``python -m benchmarks fit_diagnosis`` fits them and writes ``calibration.json`` beside this file, with how.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any


@dataclass(frozen=True)
class Calibration:
    """Fitted calibration, with and without pressure.

    Parameters
    ----------
    with_pressure, without_pressure : Mapping[str, Mapping[str, float]]
        ``weights`` by evidence and ``widths`` by severity [dimensionless].
    provenance : Mapping[str, object]
        What it was fitted on.
    """

    with_pressure: Mapping[str, Mapping[str, float]]
    without_pressure: Mapping[str, Mapping[str, float]]
    provenance: Mapping[str, object]

    def weights(self, pressure: bool) -> Mapping[str, float]:
        """Return the weights of the evidences.

        Parameters
        ----------
        pressure : bool
            Whether differential pressure is logged.

        Returns
        -------
        Mapping[str, float]
            By evidence [dimensionless].
        """
        return (self.with_pressure if pressure else self.without_pressure)["weights"]

    def widths(self, pressure: bool) -> Mapping[str, float]:
        """Return the factors on the severities' intervals.

        Parameters
        ----------
        pressure : bool
            Whether differential pressure is logged.

        Returns
        -------
        Mapping[str, float]
            By severity [dimensionless].
        """
        return (self.with_pressure if pressure else self.without_pressure)["widths"]


@cache
def shipped_calibration() -> Calibration:
    """Return the calibration that ships with the package.

    Returns
    -------
    Calibration
        The numbers.

    Examples
    --------
    >>> shipped_calibration().weights(True)["parameters"] > 0.0
    True
    """
    found: dict[str, Any] = json.loads((files("faults.diagnosis") / "calibration.json").read_text(encoding="utf-8"))
    return Calibration(found["with_pressure"], found["without_pressure"], found["provenance"])
