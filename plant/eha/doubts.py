"""Default uncertainties of a gear-pump actuator's rig entries, for entries without one in the rig file.

Nobody supplies a rig file with error bars, and bulk modulus is known no better than the volume to which it refers. Each
entry below is what one would bet on a figure from a catalogue, and on a figure measured on the bench.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

from plant.eha.model import EhaParameters

PRESSURE_GAIN = "pressure_gain"
"""Name of the gain of the differential pressure: it has only an uncertainty, its value is 1."""


class Spread(NamedTuple):
    """Uncertainty of an entry, downwards and upwards.

    Parameters
    ----------
    down, up : float
        Standard deviation of its logarithm below and above the given value [dimensionless].
    """

    down: float
    up: float

    @staticmethod
    def of(one: "float | Spread") -> "Spread":
        """Return a spread from one number that is the same in both directions.

        Parameters
        ----------
        one : float or Spread
            Relative standard deviation [fraction].

        Returns
        -------
        Spread
            The argument itself if it is a spread.
        """
        return one if isinstance(one, Spread) else Spread(one, one)


@dataclass(frozen=True)
class DefaultUncertainty:
    """Default uncertainty of an entry without one in the rig file.

    Parameters
    ----------
    usual, measured : Spread
        Spread of a figure from a drawing or a catalogue, and of a figure measured on the bench.
    reason : str
        Origin of both.
    """

    usual: Spread
    measured: Spread
    reason: str


DEFAULT_UNCERTAINTIES: Mapping[str, DefaultUncertainty] = {
    "pump_displacement": DefaultUncertainty(
        Spread.of(0.03),
        Spread.of(0.01),
        "judged: a catalogue gives geometric displacement, a few per cent more than the pump delivers; measured as "
        "ISO 4409 class B, flow within 1.5 %",
    ),
    "piston_area": DefaultUncertainty(
        Spread.of(0.02),
        Spread.of(0.003),
        "judged: tolerances of bore and rod (ISO 286 H8, 0.1 %) matter less than a wrong rod or a wrong mean of two "
        "areas; measured with a calliper",
    ),
    "chamber_volume": DefaultUncertainty(
        Spread.of(0.15),
        Spread.of(0.05),
        "judged: the drawing of the cylinder leaves out ports, hoses and manifold, and mid-stroke is known only "
        "roughly; measured by filling, without the air that stays inside",
    ),
    "moving_mass": DefaultUncertainty(
        Spread(0.1, 0.4),
        Spread(0.05, 0.05),
        "judged: a catalogue's piston and rod leave out the load, and oil in a line counts by the square of piston "
        "area over line area (0.3 m of 12 mm line add 5 kg on 15 cm^2); measured by weighing with the load",
    ),
    "accumulator_pressure": DefaultUncertainty(
        Spread.of(0.2),
        Spread.of(0.05),
        "judged: gas is charged at another temperature (20 K are 7 %) and seeps away over years; measured with a "
        "gauge on the inner circuit",
    ),
    "accumulator_gas": DefaultUncertainty(
        Spread.of(0.3),
        Spread.of(0.1),
        "judged, where it is given: a catalogue gives the shell, and the gas is what charge and filling leave of it; "
        "measured by filling and pressure",
    ),
    PRESSURE_GAIN: DefaultUncertainty(
        Spread.of(0.015),
        Spread.of(0.003),
        "judged: an industrial transmitter stays within ISO 4409 class C, 2.5 % of pressure, over years and "
        "temperatures; measured against a reference gauge, class A, within 0.5 %",
    ),
}
"""Default uncertainty of each uncertain entry; any other entry is taken as known unless the rig file gives an
uncertainty."""


def spreads_of(
    doubts: Mapping[str, DefaultUncertainty], given: Mapping[str, float], measured: Collection[str]
) -> dict[str, Spread]:
    """Return the uncertainty of each entry.

    Parameters
    ----------
    doubts : Mapping[str, DefaultUncertainty]
        Default uncertainties.
    given : Mapping[str, float]
        Uncertainties in a rig file: relative standard deviation [fraction].
    measured : collection of str
        Entries that the file says were measured.

    Returns
    -------
    dict[str, Spread]
        By entry; the file's uncertainty takes precedence over the default.

    Examples
    --------
    >>> spreads_of(DEFAULT_UNCERTAINTIES, {"moving_mass": 0.02}, ["chamber_volume"])["chamber_volume"]
    Spread(down=0.05, up=0.05)
    """
    usual = {name: one.measured if name in measured else one.usual for name, one in doubts.items()}
    return usual | {name: Spread.of(std) for name, std in given.items()}


def default_uncertainties(parameters: Any) -> Mapping[str, DefaultUncertainty]:
    """Return the default uncertainties of an actuator's entries; none for kinds other than the gear-pump one.

    Parameters
    ----------
    parameters : dataclass or its type
        The actuator's parameters [SI].
    """
    kind = parameters if isinstance(parameters, type) else type(parameters)
    return DEFAULT_UNCERTAINTIES if issubclass(kind, EhaParameters) else MappingProxyType({})
