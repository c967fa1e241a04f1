"""The piezo-stack paper's own identification, equations 23 to 33 as printed, to show its result (errata P14).

A small step gives k_u/k, a small sine alpha, a large loop the four shape parameters from four sign regions. But at
small amplitude the stack moves by (k_u/k + alpha) u, so step and sine measure the same sum, and a loop with a wrong k_u
hardly enters one of the regions.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array

REGIONS = np.array([[1.0, 1.0, 1.0, 1.0], [-1.0, 1.0, -1.0, 1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, -1.0, -1.0, 1.0]])
"""Signs of phi_1, phi_2, phi_3 and gamma where (rate, h) are (+, +), (+, -), (-, +), (-, -): equation 33."""


@dataclass(frozen=True)
class PrintedFit:
    """Result of the printed procedure.

    Parameters
    ----------
    values : Mapping[str, float]
        Values by the names of `plant.piezo_stack.parameters` [SI], in equation 1's signs; NaN if a region held no
        samples.
    samples : tuple of int
        Samples in the four regions of `REGIONS`.
    """

    values: Mapping[str, float]
    samples: tuple[int, ...]


def printed_fit(step: tuple[float, float], sine: tuple[Array, Array], loop: tuple[Array, Array]) -> PrintedFit:
    """Follow equations 23 to 33 as printed.

    Parameters
    ----------
    step : tuple of float
        A small voltage step [V], and the displacement at which it settles [m].
    sine : tuple of ndarray, shape (n,)
        Voltage [V] and displacement [m] of a small slow sine.
    loop : tuple of ndarray, shape (m,)
        Voltage [V] and displacement [m] of a large slow loop.
    """
    a = step[1] / step[0]
    du, dx = (np.gradient(values) for values in sine)
    moving = np.abs(du) > 1e-3 * np.abs(du).max()
    alpha = float(np.mean((dx[moving] - a * du[moving]) / du[moving]))  # equation 32
    u, x = loop
    h = x - a * u
    du, dh = np.gradient(u), np.gradient(h)
    sums = np.full(4, np.nan)
    counts: list[int] = []
    for region, (rising, positive) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        inside = (np.sign(du) == rising) & (np.sign(h) == positive)
        counts.append(int(inside.sum()))
        weight = du[inside] * np.abs(h[inside])
        if counts[-1] and float(weight @ weight) > 0.0:
            sums[region] = float((alpha * du[inside] - dh[inside]) @ weight / (weight @ weight))
    phi_1, phi_2, phi_3, gamma = REGIONS.T @ sums / 4.0  # the sign matrix is orthogonal
    values = {
        "free_stroke_a_volt": a,
        "hysteresis": -alpha,
        "hysteresis_phi_1": float(phi_1),
        "hysteresis_phi_2": float(-phi_2),
        "hysteresis_phi_3": float(phi_3),
        "hysteresis_gamma": float(-gamma),
    }
    return PrintedFit(values, tuple(counts))
