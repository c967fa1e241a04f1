"""Compiled loops over a whole trajectory: the model's run under pushes, and the best linear correction of it.

A trajectory is ``s_0 = prior + P_0 u_0`` and ``s_k = f(s_{k-1}) + Q_k u_k``: so written, with an adjoint ``u`` in the
place of the noise, a state that no noise moves and a start that is known exactly need no inverse of a zero variance.
`estimation.iterated_smoother` says what is done with it.
"""

from functools import cache
from types import ModuleType

from estimation.algebra import EKF, belief_symbols, moved, observed, scaled_step
from estimation.layout import layout
from estimation.model import ProcessModel
from estimation.parts import HEADER, data_places, function_source
from estimation.robust import inflation
from plant.compiled.expression import ONE, ZERO, jacobian, symbol
from plant.compiled.kernel_file import load_kernel

_LOOPS = '''

@numba.njit(cache=True, nogil=True, error_model="numpy")
def roll(start, adjoint, opened, bounds, rows, drives, measured, spread, substeps, trajectory):
    """Run the model under its pushes, held to the states' bounds, and return the sum of squares.

    It is infinite where the run diverges, or begins out of bounds.
    """
    state, seen, slope = start.copy(), np.empty({channels}), np.empty(({channels}, {width}))
    cost = 0.0
    for i in range({width}):
        if not (bounds[i, 0] <= state[i] <= bounds[i, 1]):
            return np.inf
    for k in range(measured.shape[0]):
        if k > 0:
            for j in range(substeps):
                advance(state, rows, drives[k - 1], drives[k], float(j))
            for i in range({width}):
                state[i] += opened[k, i] * adjoint[k, i]
                cost += opened[k, i] * adjoint[k, i] * adjoint[k, i]
        for i in range({width}):
            if math.isnan(state[i]):
                return np.inf
            state[i] = min(max(state[i], bounds[i, 0]), bounds[i, 1])
            trajectory[k, i] = state[i]
        see(state, rows, seen, slope)
        for c in range({channels}):
            if not math.isnan(measured[k, c]):
                cost += (measured[k, c] - seen[c]) ** 2 / spread[k, c]
    return cost


@numba.njit(cache=True, nogil=True, error_model="numpy")
def forward(
    prior, P, trajectory, adjoint, opened, rows, drives, measured, spread, substeps,
    F, gain, slope, residual, variance, every, kept,
):
    """Filter deviations from the trajectory; leave the filter's last covariance in P, and some on the way in kept."""
    m, state, before = prior - trajectory[0], np.empty({width}), np.empty({width})
    J, product, half = np.eye({width}), np.empty(({width}, {width})), np.empty(({width}, {width}))
    seen, PH = np.empty({channels}), np.empty({width})
    for k in range(measured.shape[0]):
        if k > 0:
            state[:] = trajectory[k - 1]
            F[k] = np.eye({width})
            for j in range(substeps):
                differentiate(state, rows, drives[k - 1], drives[k], float(j), J)
                multiply(J, F[k], product)
                F[k] = product
            before[:] = m
            for i in range({width}):
                m[i] = -opened[k, i] * adjoint[k, i]
                for l in range({width}):
                    m[i] += F[k, i, l] * before[l]
            multiply(F[k], P, half)
            for i in range({width}):
                for l in range(i, {width}):
                    total = opened[k, i] if i == l else 0.0
                    for o in range({width}):
                        total += half[i, o] * F[k, l, o]
                    P[i, l] = P[l, i] = total
        if k % every == 0:
            kept[k // every] = P
        see(trajectory[k], rows, seen, slope[k])
        for c in range({channels}):
            if math.isnan(measured[k, c]):
                residual[k, c] = variance[k, c] = np.nan
                continue
            e, s = measured[k, c] - seen[c], spread[k, c]
            for i in range({width}):
                PH[i] = 0.0
                for l in range({width}):
                    PH[i] += P[i, l] * slope[k, c, l]
            for i in range({width}):
                e -= slope[k, c, i] * m[i]
                s += slope[k, c, i] * PH[i]
            residual[k, c], variance[k, c] = e, s
            for i in range({width}):
                gain[k, c, i] = PH[i] / s
                m[i] += gain[k, c, i] * e
                for l in range(i, {width}):
                    P[i, l] -= PH[i] * PH[l] / s
                    P[l, i] = P[i, l]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def multiply(a, b, product):
    for i in range({width}):
        for l in range({width}):
            total = 0.0
            for o in range({width}):
                total += a[i, o] * b[o, l]
            product[i, l] = total


@numba.njit(cache=True, nogil=True, error_model="numpy")
def backward(F, gain, slope, residual, variance, wanted):
    """Carry the adjoint back over the log: what pushes the trajectory to where it fits best."""
    u, earlier = np.zeros({width}), np.empty({width})
    for k in range(residual.shape[0] - 1, -1, -1):
        for c in range({channels} - 1, -1, -1):
            if not math.isnan(residual[k, c]):
                known = residual[k, c] / variance[k, c]
                for i in range({width}):
                    known -= gain[k, c, i] * u[i]
                for i in range({width}):
                    u[i] += slope[k, c, i] * known
        wanted[k] = u
        if k > 0:
            for i in range({width}):
                earlier[i] = 0.0
                for l in range({width}):
                    earlier[i] += F[k, l, i] * u[l]
            u[:] = earlier


@numba.njit(cache=True, nogil=True, error_model="numpy")
def spread_back(F, gain, slope, residual, variance, every, kept):
    """Turn the covariances kept on the way, which knew the log up to there, into those that know all of it."""
    U, half, PU = np.zeros(({width}, {width})), np.empty(({width}, {width})), np.empty(({width}, {width}))
    UK = np.empty({width})
    for k in range(residual.shape[0] - 1, -1, -1):
        for c in range({channels} - 1, -1, -1):
            if not math.isnan(residual[k, c]):
                known = 1.0 / variance[k, c]
                for i in range({width}):
                    UK[i] = 0.0
                    for l in range({width}):
                        UK[i] += U[i, l] * gain[k, c, l]
                for i in range({width}):
                    known += gain[k, c, i] * UK[i]
                for i in range({width}):
                    for l in range({width}):
                        H, G = slope[k, c, i], slope[k, c, l]
                        U[i, l] += H * G * known - H * UK[l] - UK[i] * G
        if k % every == 0:
            multiply(kept[k // every], U, PU)
            multiply(PU, kept[k // every], half)
            kept[k // every] -= half
        if k > 0:
            multiply(U, F[k], half)
            multiply(np.ascontiguousarray(F[k].T), half, U)
'''


_WEIGHTS = '''

@numba.njit(cache=True, nogil=True, error_model="numpy")
def reweigh(trajectory, rows, measured, variances, spread):
    """Set the variances of all samples by how far they lie from the trajectory."""
    seen, slope, ratio = np.empty({channels}), np.empty(({channels}, {width})), np.empty(1)
    for k in range(measured.shape[0]):
        see(trajectory[k], rows, seen, slope)
        for c in range({channels}):
            ratio[0] = (measured[k, c] - seen[c]) ** 2 / variances[c]
            doubt(ratio)
            spread[k, c] = variances[c] * ratio[0] if not math.isnan(measured[k, c]) else variances[c]
'''


@cache
def compile_trajectory(model: ProcessModel, channels: tuple[str, ...], robust: str) -> ModuleType:
    """Generate and load the loops.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.
    robust : str
        How residuals that are too large count, see `estimation.robust.inflation`.

    Returns
    -------
    ModuleType
        ``roll``, ``forward``, ``backward`` and ``spread_back``; ``reweigh`` where outliers count for less.
    """
    n, names = model.width, layout(EKF, model, channels).rows
    mean, _ = belief_symbols(model)
    place = {f"z{i}": f"state[{i}]" for i in range(n)}
    reads = {**place, **data_places(model, channels), **{name: f"rows[{i}]" for i, name in enumerate(names)}}
    stepped, F = scaled_step(model)
    slopes = {f"F{i}_{j}": F[i][j] for i in range(n) for j in range(n) if F[i][j] is not (ONE if i == j else ZERO)}
    new = {f"z{i}": z for i, z in enumerate(moved(model, mean))}
    written = {**place, **{f"F{i}_{j}": f"jacobian[{i}, {j}]" for i in range(n) for j in range(n)}}
    seen = observed(model, mean, channels)
    H = {f"H{c}_{i}": value for c, row in enumerate(jacobian(seen, mean)) for i, value in enumerate(row)}
    source = HEADER.format(title=f"trajectories of the {model.name} form")
    source += function_source("advance", "state, rows, before, after, j", reads, new, place)
    source += function_source(
        "differentiate",
        "state, rows, before, after, j, jacobian",
        reads,
        {**{f"z{i}": z for i, z in enumerate(stepped)}, **slopes},
        written,
    )
    shown = {f"e{c}": value for c, value in enumerate(seen)}
    places = {name: f"seen[{name[1:]}]" for name in shown} | {
        name: f"slope[{name[1:].replace('_', ', ')}]" for name in H
    }
    source += function_source("see", "state, rows, seen, slope", reads, {**shown, **H}, places)
    source += _LOOPS.format(width=n, channels=len(channels))
    if robust != "none":
        doubted = {"factor": inflation(robust, symbol("x"))}
        source += function_source("doubt", "ratio", {"x": "ratio[0]"}, doubted, {"factor": "ratio[0]"})
        source += _WEIGHTS.format(width=n, channels=len(channels))
    return load_kernel(f"trajectory_{model.name}", source)
