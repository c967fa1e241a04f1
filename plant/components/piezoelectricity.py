"""Linear piezoelectricity of a poled ceramic, class 6mm: equations 8 to 12 of the diaphragm-motor paper.

Vectors of strain and stress have six components in Voigt's order, 11, 22, 33, 23, 13, 12; those of field and electric
displacement have three. A ceramic poled along 3 has s_13 = s_23, s_44 = s_55, d_31 = d_32, d_15 = d_24 and eps_11 =
eps_22, which the printed matrices do not state (errata M10, M11 and M12).
"""

from dataclasses import dataclass

import numpy as np

from plant.arrays import Array
from plant.units import si

PZT_5H = "PZT-5H; Erturk and Inman, Piezoelectric Energy Harvesting (2011), appendix E"

VACUUM = 8.8541878128e-12
"""Permittivity of vacuum [F/m]."""


@dataclass(frozen=True, kw_only=True)
class PoledCeramic:
    """The independent constants of a ceramic poled along 3; PZT-5H by default.

    Examples
    --------
    >>> PoledCeramic().d_31
    -2.74e-10
    """

    s_11: float = si(16.5e-12, "1/Pa", "compliance at constant field", PZT_5H)
    s_12: float = si(-4.78e-12, "1/Pa", "compliance at constant field", PZT_5H)
    s_13: float = si(-8.45e-12, "1/Pa", "compliance at constant field", PZT_5H)
    s_33: float = si(20.7e-12, "1/Pa", "compliance at constant field", PZT_5H)
    s_44: float = si(43.5e-12, "1/Pa", "shear compliance at constant field", PZT_5H)
    d_31: float = si(-274e-12, "m/V", "strain across the field", PZT_5H)
    d_33: float = si(593e-12, "m/V", "strain along the field", PZT_5H)
    d_15: float = si(741e-12, "m/V", "shear", PZT_5H)
    eps_11: float = si(3130.0 * VACUUM, "F/m", "permittivity at constant stress", PZT_5H)
    eps_33: float = si(3400.0 * VACUUM, "F/m", "permittivity at constant stress", PZT_5H)


def compliance_matrix(c: PoledCeramic) -> Array:
    """Return the compliance at constant field, equations 9 and 11 with errata M11.

    Returns
    -------
    ndarray, shape (6, 6)
        s^E [1/Pa], symmetric; s_66 = 2 (s_11 - s_12).

    Examples
    --------
    >>> round(1e12 * float(compliance_matrix(PoledCeramic())[5, 5]), 2)
    42.56
    """
    s = np.zeros((6, 6))
    s[:3, :3] = [[c.s_11, c.s_12, c.s_13], [c.s_12, c.s_11, c.s_13], [c.s_13, c.s_13, c.s_33]]
    s[3, 3] = s[4, 4] = c.s_44
    s[5, 5] = 2.0 * (c.s_11 - c.s_12)
    return s


def charge_matrix(c: PoledCeramic) -> Array:
    """Return the piezoelectric constants, equation 12 with errata M12; equation 11 has the transposed matrix.

    Returns
    -------
    ndarray, shape (3, 6)
        d [m/V], which is C/N.
    """
    d = np.zeros((3, 6))
    d[2, :3] = c.d_31, c.d_31, c.d_33
    d[0, 4] = d[1, 3] = c.d_15
    return d


def strain(stress: Array, field: Array, c: PoledCeramic) -> Array:
    """Return the strain of a ceramic under stress and field: the converse effect, equations 10 and 11 (errata M10).

    Parameters
    ----------
    stress : ndarray, shape (6,)
        T [Pa].
    field : ndarray, shape (3,)
        E [V/m].

    Returns
    -------
    ndarray, shape (6,)
        S [dimensionless].

    Examples
    --------
    >>> float(strain(np.zeros(6), np.array([0.0, 0.0, 5e5]), PoledCeramic())[0])
    -0.000137
    """
    return compliance_matrix(c) @ stress + charge_matrix(c).T @ field


def electric_displacement(stress: Array, field: Array, c: PoledCeramic) -> Array:
    """Return the electric displacement due to stress and field: the direct effect, equations 8, 10 and 12 (errata M12).

    Parameters
    ----------
    stress : ndarray, shape (6,)
        T [Pa].
    field : ndarray, shape (3,)
        E [V/m].

    Returns
    -------
    ndarray, shape (3,)
        D [C/m^2].

    Examples
    --------
    >>> float(electric_displacement(np.array([1e6, 0.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(3), PoledCeramic())[2])
    -0.000274
    """
    return charge_matrix(c) @ stress + np.array([c.eps_11, c.eps_11, c.eps_33]) * field
