"""A state space with two inputs and two outputs against the Cramér-Rao bound: errors, and coverage of its intervals.

Each log has fresh inputs and fresh noise, correlated between the outputs. The error is evaluated on quantities that do
not depend on the basis of the states: poles, steady gains, and the frequency response at eight frequencies. The bound
is computed at the truth, with matrices, levels and initial states unknown. ``--order auto`` counts instead how often
the number of states is found.
"""

import argparse
from dataclasses import replace

import numpy as np

from benchmarks.targets import check_target, misses
from estimation.arrays import Array
from estimation.finding import NORMAL_95
from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.state_space.dynamics import StateSpaceDynamics, system_in_units
from estimation.identification.state_space.identify import identify_state_space
from estimation.identification.state_space.joint import Joint, joined_outputs
from estimation.identification.state_space.problem import Problem, Size, Values
from estimation.identification.state_space.system import StateSpace

SAMPLES, SAMPLE_TIME = 1000, 0.01
NOISE = np.array([[0.02, 0.0], [0.012, 0.016]])
"""Square root of the noise covariance between the outputs [output units]."""

A = np.array([[0.8, 0.3, 0.0], [-0.3, 0.8, 0.0], [0.0, 0.0, 0.9]])
B = np.array([[0.2, 0.1], [0.0, -0.3], [0.1, 0.2]])
C = np.array([[1.0, 0.0, 0.5], [0.3, 1.0, -1.0]])
LEVEL = np.array([5.0, -2.0])

FREQUENCIES = np.array([0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 15.0, 30.0])
"""Frequencies at which responses are compared [Hz]."""


def plant() -> StateSpace:
    """Return the plant, in its units, without covariance."""
    none = np.zeros((9 + 6 + 6 + 2, 9 + 6 + 6 + 2))
    return StateSpace(A, B, C, np.zeros((2, 2)), LEVEL, (0, 0), False, SAMPLE_TIME, none)


def draw_log(seed: int, samples: int = SAMPLES) -> list[Channels]:
    """Return a log of the plant, one entry for each output."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], size=(samples // 4 + 1, 2)), 4, axis=0)[:samples]
    x, y = np.zeros(3), np.empty((samples, 2))
    for t in range(samples):
        y[t] = C @ x + LEVEL
        x = A @ x + B @ u[t]
    y += rng.normal(size=y.shape) @ NOISE.T
    return [channels_from([u], [y[:, k]], SAMPLE_TIME, ["a", "b"], name) for k, name in enumerate("yz")]


def with_covariance_bound(data: list[Channels]) -> StateSpace:
    """Return the plant with the covariance bound of unbiased estimates from one log."""
    together = Joint(
        SAMPLE_TIME, joined_outputs(data).u, tuple(np.full_like(y, np.nan) for y in joined_outputs(data).y)
    )
    size = Size(3, 2, 2, direct=False)
    problem = Problem(size, together)
    theta = problem.packed(Values(A, B, C, np.zeros((2, 2)), LEVEL, np.zeros((1, 3))))
    _, slopes = problem.jacobian(theta)
    basis = problem.directions(theta)
    white = np.tensordot(np.linalg.inv(NOISE), slopes @ basis, axes=1).reshape(-1, basis.shape[1])
    k = size.n_matrices
    return replace(plant(), covariance=(basis @ np.linalg.inv(white.T @ white) @ basis.T)[:k, :k])


def model_values(system: StateSpace) -> tuple[Array, Array]:
    """Return poles, steady gains and responses of a model as real numbers, with their standard deviations."""
    order = np.lexsort((system.poles.imag, system.poles.real))
    poles, spread = system.poles[order], system.pole_std[order]
    values, slopes = [poles.real, poles.imag], [spread.real, spread.imag]
    for frequency in (0.0, *FREQUENCIES):
        gain, slope = system.response(complex(np.exp(2j * np.pi * frequency * SAMPLE_TIME)))
        for part, by in ((gain.real, slope.real), (gain.imag, slope.imag)):
            values.append(part.ravel())
            slopes.append(np.sqrt(np.einsum("oji,ik,ojk->oj", by, system.covariance, by)).ravel())
    together, deviations = np.concatenate(values), np.concatenate(slopes)
    return together, deviations


def identified_model(data: list[Channels], order: int | None) -> StateSpace:
    """Return the model identified from a log, in its units."""
    models = [one.model for one in identify_state_space(data, order=order, delay=None if order is None else 1)]
    outputs = [one.dynamics for one in models if isinstance(one.dynamics, StateSpaceDynamics)]
    return system_in_units(outputs, [one.scaling for one in models])


def main(arguments: list[str] | None = None) -> int:
    """Compare errors with the bound and with the stated standard deviations; return how many targets are missed."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", type=int, default=100)
    options.add_argument("--order", default="3")
    chosen = options.parse_args(arguments)
    misses.clear()
    if chosen.order == "auto":
        orders = [identified_model(draw_log(seed), None).order for seed in range(chosen.seeds)]
        print("orders chosen:", {int(n): orders.count(int(n)) for n in np.unique(orders)})
        check_target("order found [%]", 100.0 * orders.count(3) / len(orders), 90.0, most=False)
        return len(misses)
    truth = model_values(plant())[0]
    errors, said, least = list[Array](), list[Array](), list[Array]()
    for seed in range(chosen.seeds):
        data = draw_log(seed)
        values, deviations = model_values(identified_model(data, int(chosen.order)))
        errors.append(values - truth)
        said.append(deviations)
        least.append(model_values(with_covariance_bound(data))[1])
    free = np.array(least).mean(axis=0) > 1e-9  # a real pole and a steady gain have no imaginary part
    error, deviation, limit = (np.array(one)[:, free] for one in (errors, said, least))
    ratio = float(np.sqrt(np.mean((error / limit) ** 2)))
    check_target("rms error over the bound", ratio, 0.95, most=False)
    check_target("rms error over the bound", ratio, 1.05)
    own = float(np.sqrt(np.mean((error / deviation) ** 2)))
    check_target("rms error over the deviation said", own, 0.95, most=False)
    check_target("rms error over the deviation said", own, 1.05)
    share = 100.0 * float(np.mean(np.abs(error) <= NORMAL_95 * deviation))
    check_target("95 % intervals that cover [%]", share, 93.0, most=False)
    check_target("95 % intervals that cover [%]", share, 97.0)
    worst = np.sqrt(np.mean((error / limit) ** 2, axis=0))
    print(f"single quantities: error over the bound {worst.min():.2f} to {worst.max():.2f}")
    return len(misses)
