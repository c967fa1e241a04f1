"""A piezo diaphragm as a composite thin plate: bending by pressure and voltage, and dry natural modes.

It replaces the diaphragm-motor paper's finite elements and its equation 14, a bimorph's formula (errata M14). The model
is a brass disc clamped at its rim with a smaller ceramic disc on it, Table 1. Thin-plate theory couples stretching and
bending in the ceramic region. The solution in each of the two regions is in closed form, and six constants join them.
Source: Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 2nd edition, sections 15 to 17; Reddy, Mechanics
of Laminated Composite Plates and Shells, 2nd edition, section 3.3.
"""

from dataclasses import dataclass
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import iv, jv

from plant.arrays import Array
from plant.components.piezoelectricity import PZT_5H
from plant.errors import RigError
from plant.units import require_numbers, si

TABLE_1 = "Table 1"
HANDBOOK = "handbook value, errata M22"


@dataclass(frozen=True, kw_only=True)
class PlateParameters:
    """A brass disc with a ceramic disc on one face, clamped at a radius; the motor's diaphragm by default.

    Raises
    ------
    RigError
        If a value is not finite and positive (the ceramic's thickness may be 0), or the ceramic reaches the clamp.

    Examples
    --------
    >>> round(1e3 * PlateParameters().thickness, 1)
    0.6
    """

    clamp_radius: float = si(14e-3, "m", "radius a at which the brass is held", "calibrated, errata M22")
    ceramic_radius: float = si(12.5e-3, "m", "radius of the ceramic", TABLE_1)
    brass_thickness: float = si(0.4e-3, "m", "thickness of the brass", TABLE_1)
    ceramic_thickness: float = si(0.2e-3, "m", "thickness of the ceramic", TABLE_1, zero=True)
    brass_modulus: float = si(100e9, "Pa", "Young's modulus of brass", HANDBOOK)
    ceramic_compliance: float = si(16.5e-12, "1/Pa", "compliance s_11 at constant field", PZT_5H)
    poisson_ratio: float = si(0.35, "1", "Poisson's ratio of both", HANDBOOK)
    brass_density: float = si(8500.0, "kg/m^3", "density of brass", HANDBOOK)
    ceramic_density: float = si(7500.0, "kg/m^3", "density of the ceramic", PZT_5H)
    charge_constant: float = si(274e-12, "m/V", "size of the piezoelectric constant d_31", PZT_5H)

    def __post_init__(self) -> None:
        require_numbers(self)
        if self.ceramic_radius >= self.clamp_radius:
            raise RigError(
                f"ceramic_radius must be below {self.clamp_radius:g} m, the clamp, got {self.ceramic_radius:g}"
            )

    @property
    def thickness(self) -> float:
        """Thickness of both discs together [m]."""
        return self.brass_thickness + self.ceramic_thickness


class PlateCoefficients(NamedTuple):
    """Coefficients of a diaphragm: displaced volume and centre deflection per pressure and per voltage.

    Parameters
    ----------
    compliance : float
        Volume per pascal, C_d [m^3/Pa].
    volume_a_volt : float
        Volume per volt without pressure, d_V [m^3/V].
    deflection_a_pascal : float
        Centre deflection per pascal, w_p [m/Pa].
    deflection_a_volt : float
        Centre deflection per volt without pressure, w_V [m/V].
    """

    compliance: float
    volume_a_volt: float
    deflection_a_pascal: float
    deflection_a_volt: float


class PlateMode(NamedTuple):
    """A mode of a clamped round plate.

    Parameters
    ----------
    diameters, circles : int
        Number of nodal diameters, and of nodal circles excluding the rim.
    root : float
        lambda^2 of ``f = lambda^2 / (2 pi a^2) sqrt(D / m)`` [dimensionless].
    frequency : float
        Natural frequency without liquid [Hz].
    """

    diameters: int
    circles: int
    root: float
    frequency: float


class _Region(NamedTuple):
    """Stretching, coupling and bending stiffness about the brass's middle plane, and force and moment per volt."""

    stretch: float
    couple: float
    bend: float
    force: float
    moment: float


def _regions(p: PlateParameters) -> tuple[_Region, _Region]:
    plane = 1.0 - p.poisson_ratio**2
    brass, half = p.brass_modulus / plane, 0.5 * p.brass_thickness
    ceramic, top = 1.0 / p.ceramic_compliance / plane, half + p.ceramic_thickness
    bare = _Region(2.0 * half * brass, 0.0, 2.0 * half**3 / 3.0 * brass, 0.0, 0.0)
    drawn = p.charge_constant / (p.ceramic_compliance * (1.0 - p.poisson_ratio)) if p.ceramic_thickness > 0.0 else 0.0
    covered = _Region(
        bare.stretch + ceramic * p.ceramic_thickness,
        0.5 * ceramic * (top**2 - half**2),
        bare.bend + ceramic * (top**3 - half**3) / 3.0,
        drawn,
        drawn * 0.5 * (top + half),
    )
    return covered, bare


def _solution_terms(region: _Region, nu: float, r: float, pressure: float) -> tuple[Array, Array, Array]:
    """Return (u, slope, N, M) at a radius for the constants (c r, c/r, d r, d/r), for pressure, and for one volt.

    Slope is -w'. Pressure adds the slope ``-p r^3 / (16 D*)`` and the stretch that the coupling requires.
    """
    a, b, d = region.stretch, region.couple, region.bend
    swell, shrink = 1.0 + nu, -(1.0 - nu) / r**2
    constants = np.array(
        [
            [0.0, 0.0, r, 1.0 / r],
            [r, 1.0 / r, 0.0, 0.0],
            [b * swell, b * shrink, a * swell, a * shrink],
            [d * swell, d * shrink, b * swell, b * shrink],
        ]
    )
    turned = -pressure / (16.0 * (d - b * b / a))
    bowed = turned * r**2 * (3.0 + nu)
    loaded = np.array([-b / a * turned * r**3, turned * r**3, 0.0, (d - b * b / a) * bowed])
    return constants, loaded, np.array([0.0, 0.0, -region.force, -region.moment])


class _BendingConstants(NamedTuple):
    """Constants of the closed form in the two regions: terms that grow with r, that fall with r, and of pressure."""

    inner: float
    outer: float
    outer_inverse: float
    turned_inner: float
    turned_outer: float


def _bending_constants(p: PlateParameters, pressure: float, volts: float) -> _BendingConstants:
    """Return the bending of the plate under a voltage and a pressure on the ceramic's side."""
    covered, bare = _regions(p)
    nu, b, a = p.poisson_ratio, p.ceramic_radius, p.clamp_radius
    inner, inner_load, inner_volt = _solution_terms(covered, nu, b, pressure)
    outer, outer_load, _ = _solution_terms(bare, nu, b, pressure)
    rim, rim_load, _ = _solution_terms(bare, nu, a, pressure)
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    matrix[:4, :2], matrix[:4, 2:] = inner[:, [0, 2]], -outer
    right[:4] = outer_load - inner_load - volts * inner_volt
    matrix[4:, 2:], right[4:] = rim[:2], -rim_load[:2]
    scale = np.abs(matrix).max(axis=1)
    columns = np.abs(matrix / scale[:, None]).max(axis=0)
    c_in, _, c, c_inverse, _, _ = np.linalg.solve(matrix / scale[:, None] / columns, right / scale) / columns
    turned_in, turned_out = (-pressure / (16.0 * (x.bend - x.couple**2 / x.stretch)) for x in (covered, bare))
    return _BendingConstants(float(c_in), float(c), float(c_inverse), turned_in, turned_out)


def _volume(p: PlateParameters, bent: _BendingConstants) -> float:
    """Return the displaced volume [m^3]: pi times the integral of slope r^2."""
    b, a = p.ceramic_radius, p.clamp_radius
    outer = 0.25 * bent.outer * (a**4 - b**4) + 0.5 * bent.outer_inverse * (a**2 - b**2)
    outer += bent.turned_outer * (a**6 - b**6) / 6.0
    return pi * (outer + 0.25 * bent.inner * b**4 + bent.turned_inner * b**6 / 6.0)


def plate_deflection(p: PlateParameters, pressure: float, volts: float, radii: Array) -> Array:
    """Return the deflection of the plate along a radius, by composite thin-plate theory (Table 1, errata M14).

    Parameters
    ----------
    pressure : float
        Pressure on the ceramic's side [Pa].
    volts : float
        Voltage across the ceramic [V].
    radii : ndarray, shape (n,)
        Distances from the centre, at most the clamp radius [m].

    Returns
    -------
    ndarray, shape (n,)
        Deflection [m]; zero at the clamp.

    Examples
    --------
    >>> profile = plate_deflection(PlateParameters(), 0.0, 1.0, np.array([0.0, 7e-3, 14e-3]))
    >>> np.abs(np.round(1e9 * profile, 1)).tolist()
    [83.8, 60.3, 0.0]
    """
    bent, b, a = _bending_constants(p, pressure, volts), p.ceramic_radius, p.clamp_radius
    # the slope, integrated from the rim inwards
    r = np.maximum(radii, b)
    outer = 0.5 * bent.outer * (a**2 - r**2) + bent.outer_inverse * np.log(a / r)
    outer += 0.25 * bent.turned_outer * (a**4 - r**4)
    r = np.minimum(radii, b)
    return outer + 0.5 * bent.inner * (b**2 - r**2) + 0.25 * bent.turned_inner * (b**4 - r**4)


def plate_coefficients(p: PlateParameters) -> PlateCoefficients:
    """Return the coefficients of a diaphragm, by composite thin-plate theory (Table 1, errata M14).

    Returns
    -------
    PlateCoefficients
        C_d, d_V, w_p and w_V, all positive.

    Examples
    --------
    >>> found = plate_coefficients(PlateParameters())
    >>> [float(f"{value:.3g}") for value in found]
    [1.17e-13, 2.31e-11, 5.19e-10, 8.38e-08]
    """
    volume, pumped = (_volume(p, _bending_constants(p, *load)) for load in ((1.0, 0.0), (0.0, 1.0)))
    rise, lifted = (float(plate_deflection(p, *load, np.zeros(1))[0]) for load in ((1.0, 0.0), (0.0, 1.0)))
    return PlateCoefficients(abs(volume), abs(pumped), abs(rise), abs(lifted))


def clamped_plate_roots(count: int) -> list[tuple[int, int, float]]:
    """Return the lowest roots of a clamped round plate, ``J_n I_n' - J_n' I_n = 0`` at lambda (Source: Leissa 1969).

    Returns
    -------
    list of tuple of int, int and float
        Nodal diameters, nodal circles, lambda^2; in rising order.

    Examples
    --------
    >>> [round(root, 3) for _, _, root in clamped_plate_roots(6)]
    [10.216, 21.26, 34.877, 39.771, 51.03, 60.829]
    """
    found: list[tuple[int, int, float]] = []
    for diameters in range(count):
        n = diameters

        def clamp(x: float, n: int = n) -> float:
            return float(jv(n, x) * iv(n + 1, x) + iv(n, x) * jv(n + 1, x)) / float(iv(n, x))

        grid = np.arange(1.0, 4.0 + 2.0 * count + diameters, 0.1)
        signs = np.sign([clamp(x) for x in grid])
        crossings = np.flatnonzero(signs[:-1] * signs[1:] < 0.0)
        found += [(diameters, circles, brentq(clamp, grid[k], grid[k + 1]) ** 2) for circles, k in enumerate(crossings)]
    return sorted(found, key=lambda mode: mode[2])[:count]


def plate_modes(p: PlateParameters, count: int = 6) -> list[PlateMode]:
    """Return the first modes of the dry diaphragm, as a uniform plate with its static stiffness and mean mass.

    They replace the paper's finite-element figures; liquid lowers all frequencies. Source: Leissa, Vibration of Plates
    (1969), section 2.1.

    Examples
    --------
    >>> [round(mode.frequency, -2) for mode in plate_modes(PlateParameters(), 3)]
    [4000.0, 8300.0, 13500.0]
    """
    a = p.clamp_radius
    stiffness = pi * a**6 / (192.0 * plate_coefficients(p).compliance)
    covered = (p.ceramic_radius / a) ** 2
    mass = p.brass_density * p.brass_thickness + covered * p.ceramic_density * p.ceramic_thickness
    rate = sqrt(stiffness / mass) / (2.0 * pi * a**2)
    return [PlateMode(n, s, root, root * rate) for n, s, root in clamped_plate_roots(count)]


def mode_shape(mode: PlateMode, radii: Array, angles: Array) -> Array:
    """Return the shape of a vibration mode of a clamped round plate.

    Source: Leissa, Vibration of Plates (1969), section 2.1.

    Parameters
    ----------
    mode : PlateMode
        Mode from `plate_modes`.
    radii : ndarray, shape (n,)
        Distances from the centre divided by the clamp radius, 0 to 1 [dimensionless].
    angles : ndarray, shape (n,)
        Angles from the line of largest deflection [rad].

    Returns
    -------
    ndarray, shape (n,)
        Deflection divided by the largest one returned [dimensionless].

    Examples
    --------
    >>> first = plate_modes(PlateParameters(), 1)[0]
    >>> mode_shape(first, np.array([0.0, 0.5, 1.0]), np.zeros(3)).round(3).tolist()
    [1.0, 0.525, 0.0]
    """
    n, wave = mode.diameters, sqrt(mode.root)
    shape = (jv(n, wave * radii) - jv(n, wave) / iv(n, wave) * iv(n, wave * radii)) * np.cos(n * angles)
    return shape / np.abs(shape).max()
