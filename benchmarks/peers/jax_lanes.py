"""The acceleration form's filter as a JAX expert would write it: unrolled, one array for each quantity, one scan.

Run it as a script in an environment with JAX: it reads a NumPy archive, prints CPU nanoseconds per filter step of every
round, and writes the final means.
"""

import sys
import time
from pathlib import Path

import numpy as np


def main(source: str, target: str, rounds: int) -> None:
    """Filter the archive's logs and time it."""
    import jax
    import jax.numpy as jnp
    from jax import lax

    jax.config.update("jax_enable_x64", True)
    data = np.load(source)
    Tx, Tv, T = (float(value) for value in data["steps"])
    pumped, bias, velocity, square, coulomb, acceleration, damping, quadratic = (float(c) for c in data["coefficients"])
    q, (r0, r1) = [float(value) for value in data["noise"]], [float(value) for value in data["variances"]]

    def update(m, P, i, y, r):
        gain = 1.0 / (P[i][i] + r)
        e = y - m[i]
        K = [P[i][j] * gain for j in range(4)]
        m = [m[j] + K[j] * e for j in range(4)]
        new = [[None] * 4 for _ in range(4)]
        for j in range(4):
            for k in range(j, 4):
                new[j][k] = new[k][j] = P[j][k] - K[j] * P[i][k]
        return m, new, e * e * gain

    def predict(m, P, u):
        x, v, a, b = m
        s = jnp.sign(v)
        pump = jnp.sign(u) * jnp.maximum(jnp.abs(u) * pumped - bias, 0.0)
        pull = pump + velocity * v + square * v * v * s + coulomb * s + acceleration * a
        decay = damping + 2.0 * quadratic * v * s
        f21 = T * (b * (velocity + 2.0 * square * v * s) + 2.0 * quadratic * s * a)
        f22, f23 = 1.0 + T * (b * acceleration + decay), T * pull
        G = [
            [P[0][j] + Tx * P[1][j] for j in range(4)],
            [P[1][j] + Tv * P[2][j] for j in range(4)],
            [f21 * P[1][j] + f22 * P[2][j] + f23 * P[3][j] for j in range(4)],
            P[3],
        ]

        def times(row):
            return [row[0] + Tx * row[1], row[1] + Tv * row[2], f21 * row[1] + f22 * row[2] + f23 * row[3], row[3]]

        full = [times(row) for row in G]
        new = [[full[min(j, k)][max(j, k)] + (q[j] if j == k else 0.0) for k in range(4)] for j in range(4)]
        return [x + Tx * v, v + Tv * a, a + T * (b * pull + decay * a), b], new

    def both(m, P, y):
        m, P, n0 = update(m, P, 0, y[0], r0)
        m, P, n1 = update(m, P, 1, y[1], r1)
        return m, P, n0 + n1

    @jax.jit
    def run(m, P, speed, measured):
        m, P, nis = both(m, P, measured[0])

        def step(carry, inputs):
            m, P, nis = carry
            u, y = inputs
            m, P = predict(m, P, u)
            m, P, more = both(m, P, y)
            return (m, P, nis + more), None

        (m, P, nis), _ = lax.scan(step, (m, P, nis), (speed[:-1], measured[1:]))
        return jnp.stack(m), nis

    speed, measured = jnp.asarray(data["speed"]), jnp.asarray(data["measured"])
    count = speed.shape[1]
    m = [jnp.asarray(row) for row in data["mean"]]
    P = [[jnp.full(count, value) for value in row] for row in data["covariance"]]
    found, _ = run(m, P, speed, measured)
    found.block_until_ready()
    for _ in range(rounds):
        begin = time.process_time_ns()
        run(m, P, speed, measured)[0].block_until_ready()
        print((time.process_time_ns() - begin) / speed.size)
    np.save(Path(target), np.asarray(found))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
