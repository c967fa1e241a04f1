"""The gas-charged accumulator of the inner circuit."""

from plant.compiled.functions import Scalar


def gas_pressure(amount: Scalar, charge_amount: Scalar, charge_pressure: Scalar, gas_volume: Scalar) -> Scalar:
    """Return the accumulator's absolute pressure: isothermal gas, compressed by the oil that has entered.

    Source: section 2 gives the pressure, 40 psi; isothermal is judged, since leakage flows slowly.

    Parameters
    ----------
    amount : float or Expression
        Oil held, as its volume at atmospheric pressure [m^3].
    charge_amount : float or Expression
        Oil held at the charge pressure [m^3].
    charge_pressure : float or Expression
        Charge pressure, absolute [Pa].
    gas_volume : float or Expression
        Volume of the gas at the charge pressure [m^3].

    Returns
    -------
    float or Expression
        Pressure [Pa].

    Examples
    --------
    >>> gas_pressure(0.5e-3, 1e-3, 2.758e5, 1e-3)
    183866.66666666666
    """
    return charge_pressure * gas_volume / (gas_volume + charge_amount - amount)
