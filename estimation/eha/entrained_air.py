"""Air that a log shows in the oil from its beginning: how much there is, and the oil without it."""

from collections.abc import Mapping
from typing import NamedTuple

from estimation.eha.rig_share import Responses, with_total
from estimation.finding import NORMAL_95, Quantity
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.models.wide_flow import QUICKNESS
from estimation.notes import RigCode
from plant.components.oil import ATMOSPHERE
from plant.eha.aerated import with_air_in_oil
from plant.eha.circuit_parameters import MOST_AIR
from plant.eha.doubts import Spread
from plant.eha.model import EhaParameters
from plant.notes import Note


class EntrainedAir(NamedTuple):
    """Air in the oil.

    Parameters
    ----------
    share, std : float
        Its volume at atmospheric pressure over that of the oil, and standard deviation [fraction].
    quickness : float
        1 - 1/n of its polytropic exponent n [dimensionless].
    compliance : float
        Inverse of the oil's bulk modulus at the stated pressure, air included [1/Pa].
    stated : float
        That pressure, absolute [Pa].
    """

    share: float
    std: float
    quickness: float
    compliance: float
    stated: float

    def compliance_at(self, pressure: float) -> float:
        """Return the compliance that the air alone adds to oil.

        Parameters
        ----------
        pressure : float
            Absolute [Pa].

        Returns
        -------
        float
            Per unit of oil [1/Pa].
        """
        bubbles = self.share * (ATMOSPHERE / pressure) ** (1.0 - self.quickness)
        return bubbles * (1.0 - self.quickness) / pressure

    @property
    def liquid(self) -> float:
        """Bulk modulus of the oil without it [Pa]; not positive if the air alone is as soft as the whole."""
        left = self.compliance - self.compliance_at(self.stated)
        return 1.0 / left if left else 0.0

    def isothermal(self, pressure: float) -> "EntrainedAir":
        """Return isothermal air with the same compliance at a pressure, in oil of the same total stiffness.

        Parameters
        ----------
        pressure : float
            Absolute [Pa].
        """
        share = self.compliance_at(pressure) * pressure**2 / ATMOSPHERE
        return self._replace(share=share, quickness=0.0)


def entrained_air(found: Explanation | None) -> EntrainedAir | None:
    """Return the air that is in the oil from the beginning of a log.

    Returns
    -------
    EntrainedAir or None
        None if there is none, or if it enters later.
    """
    if found is None or "air_softness" not in found.values or "air_onset" in found.values:
        return None
    share, std = (one / ATMOSPHERE for one in found.values["air_softness"])
    quickness, compliance = found.values.get(QUICKNESS, (0.0, 0.0))[0], 1.0 / found.values["bulk_modulus"][0]
    return EntrainedAir(share, std, quickness, compliance, found.stated_pressure)


def with_air(parameters: EhaParameters, found: Explanation | None) -> EhaParameters:
    """Return an actuator with the oil and air that a log shows, for a circuit, whose bubbles are isothermal.

    Their compliance equals the log's where it matters most: at the inner circuit's pressure.

    Returns
    -------
    EhaParameters
        Unchanged if there is no air, or more than oil with bubbles can hold.
    """
    if (air := entrained_air(found)) is None:
        return parameters
    air = air.isothermal(parameters.accumulator_pressure)
    fraction = air.share / (1.0 + air.share)
    return (
        with_air_in_oil(parameters, fraction, air.liquid) if air.liquid > 0.0 and fraction <= MOST_AIR else parameters
    )


def amount_of_air(
    found: Explanation | None, responses: Responses | None, spreads: Mapping[str, Spread]
) -> Quantity | None:
    """Return the air in the oil with its intervals.

    Parameters
    ----------
    found : Explanation or None
        The explanation of the log.
    responses : Responses or None
        Response of bulk modulus to the rig file's entries [dimensionless]: a larger bulk modulus means less air.
    spreads : Mapping[str, Spread]
        Uncertainty of each entry.

    Returns
    -------
    Quantity or None
        Share of the oil at atmospheric pressure [%]; None if no air explains the log.
    """
    if (air := entrained_air(found)) is None:
        return None
    one = Quantity.normal(100.0 * air.share, 100.0 * air.std, "%")
    return with_total(one, {entry: -power for entry, power in responses.items()} if responses else None, spreads)


def air_note(found: Explanation, _: EhaParameters) -> Note:
    """Return the note on air that explains a log, from its beginning or from some time on."""
    softness, std = found.values["air_softness"]
    said = {"percent": 100.0 * softness / ATMOSPHERE, "half_width": 100.0 * NORMAL_95 * std / ATMOSPHERE}
    if (air := entrained_air(found)) is None:
        return RigCode.AIR_ENTERS.note(**said, percent_of_log=100.0 * found.values["air_onset"][0])
    return RigCode.AIR_ENTRAINED.note(**said, stated_pa=found.stated_pressure, liquid_pa=air.liquid)
