"""Starts of a state-space fit: subspaces of past and future, without iteration."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.state_space.joint import Joint
from estimation.log_checks.bridging import bridged

HORIZONS = (6, 12, 24)
"""Block rows of past and future that are tried, where the data have samples for them; above the order at least."""


def subspace_starts(data: Joint, order: int) -> list[tuple[Array, Array]]:
    """Return A and C by PO-MOESP (Verhaegen 1994), one pair for each horizon, with poles inside the unit circle.

    Parameters
    ----------
    data : Joint
        Scaled.
    order : int
        States.

    Returns
    -------
    list of tuple of ndarray, shapes (n, n) and (p, n)
        Transition and outputs.
    """
    p, m = data.y[0].shape[1], data.u[0].shape[1]
    inputs, outputs = np.concatenate(data.u), np.concatenate(data.y)
    logs = [(inputs[part], outputs[part]) for part in data.slices if np.isfinite(outputs[part]).any(axis=0).all()]
    inputs, whole = [u for u, _ in logs], [np.column_stack([bridged(column) for column in y.T]) for _, y in logs]
    found: list[tuple[Array, Array]] = []
    for rows in sorted({max(one, order // p + 2) for one in HORIZONS}):
        width = sum(max(len(u) - 2 * rows + 1, 0) for u in inputs)
        if width < 2 * 2 * rows * (m + p):
            continue
        left = _observability(inputs, whole, rows)
        if left.shape[1] < order:
            continue
        gamma = left[:, :order]
        a = np.asarray(np.linalg.lstsq(gamma[:-p], gamma[p:], rcond=None)[0], dtype=np.float64)
        found.append((_stable_transition(a, data.n_samples), np.ascontiguousarray(gamma[:p])))
    return found


def _observability(u: list[Array], y: list[Array], rows: int) -> Array:
    """Return left singular vectors of the future outputs that the past explains beside the future inputs."""
    blocks = [
        np.concatenate([_hankel(a, rows, rows), _hankel(a, 0, rows), _hankel(b, 0, rows)])
        for a, b in zip(u, y, strict=True)
    ]
    future = [_hankel(b, rows, rows) for b in y]
    known = np.concatenate([np.concatenate(blocks, axis=1), np.concatenate(future, axis=1)])
    triangle = np.asarray(np.linalg.qr(known.T, mode="r"), dtype=np.float64)
    n_u, n_y = rows * u[0].shape[1], rows * y[0].shape[1]
    projected = triangle[n_u : 2 * n_u + n_y, 2 * n_u + n_y :].T
    return np.asarray(np.linalg.svd(projected, full_matrices=False)[0], dtype=np.float64)


def _hankel(x: Array, first: int, rows: int) -> Array:
    """Return block rows of a series, shape (rows * channels, width)."""
    width = len(x) - 2 * rows + 1
    if width < 1:
        return np.zeros((rows * x.shape[1], 0))
    return np.concatenate([x[first + k : first + k + width].T for k in range(rows)])


def _stable_transition(a: Array, n_samples: int) -> Array:
    """Return a transition matrix with its poles inside the unit circle; those outside are reflected."""
    values, vectors = np.linalg.eig(a)
    limit = 1.0 - 1.0 / n_samples
    radius = np.abs(values)
    if (radius <= limit).all():
        return np.ascontiguousarray(a)
    kept = np.where(
        radius > limit,
        values / np.maximum(radius, 1e-300) * np.minimum(1.0 / np.maximum(radius, 1e-300), limit),
        values,
    )
    return np.ascontiguousarray((vectors @ np.diag(kept) @ np.linalg.inv(vectors)).real)
