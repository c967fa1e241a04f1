"""Responses of a state space are those of its matrices, and their deviations are those of first order."""

from dataclasses import replace

import numpy as np

from estimation.identification.state_space.starts import _hankel, _stable_transition, subspace_starts
from estimation.identification.state_space.system import StateSpace
from tests.estimation.identification.state_space.test_state_space import in_scale, joined_outputs

N, M, P = 3, 2, 2
RNG = np.random.default_rng(4)
MATRICES = (
    np.diag([0.9, 0.5, -0.3]) + 0.05 * RNG.normal(size=(N, N)),
    RNG.normal(size=(N, M)),
    RNG.normal(size=(P, N)),
    RNG.normal(size=(P, M)),
)
SIZE = sum(one.size for one in MATRICES) + P
ROOT = 1e-3 * RNG.normal(size=(SIZE, SIZE))
SYSTEM = StateSpace(*MATRICES, np.zeros(P), (0, 2), True, 0.01, ROOT @ ROOT.T)


def gain(values: np.ndarray, z: complex) -> np.ndarray:
    a, b, c, d = np.split(values[: SIZE - P], np.cumsum([one.size for one in MATRICES])[:-1])
    whole = c.reshape(P, N) @ np.linalg.solve(z * np.eye(N) - a.reshape(N, N), b.reshape(N, M)) + d.reshape(P, M)
    return whole * z ** -np.array([0.0, 2.0])


def test_the_response_has_exact_derivatives_with_respect_to_every_parameter() -> None:
    z = complex(np.exp(0.4j))
    values = np.concatenate([*(one.ravel() for one in MATRICES), np.zeros(P)])
    found, slopes = SYSTEM.response(z)
    np.testing.assert_allclose(found, gain(values, z))
    for k, step in enumerate(1e-6 * np.eye(SIZE)):
        moved = (gain(values + step, z) - gain(values - step, z)) / 2e-6
        np.testing.assert_allclose(slopes[:, :, k], moved, atol=1e-6)


def test_a_direct_path_that_was_not_fitted_has_no_deviation() -> None:
    z = complex(np.exp(0.4j))
    without = replace(SYSTEM, d=np.zeros((P, M)), direct=False)
    first = N * N + N * M + P * N
    assert not without.response(z)[1][:, :, first : first + P * M].any()
    assert SYSTEM.response(z)[1][:, :, first : first + P * M].any()
    assert SYSTEM.n_values - without.n_values == P * M


def test_deviations_of_a_frequency_response_equal_its_spread_over_draws_from_the_covariance() -> None:
    found, spread = SYSTEM.frequency_response([1.0, 20.0])
    values = np.concatenate([*(one.ravel() for one in MATRICES), np.zeros(P)])
    draws = values + np.random.default_rng(5).normal(size=(4000, SIZE)) @ ROOT.T
    for k, frequency in enumerate((1.0, 20.0)):
        z = complex(np.exp(2j * np.pi * frequency * 0.01))
        np.testing.assert_allclose(found[k], gain(values, z))
        off = np.array([gain(one, z) for one in draws[:1500]]) - found[k]
        np.testing.assert_allclose(spread[k], np.sqrt(np.mean(np.abs(off) ** 2, axis=0)), rtol=0.1)


def test_poles_outside_the_circle_are_reflected_and_those_within_stay() -> None:
    sound = np.array([[0.5, 0.4], [-0.4, 0.5]])
    np.testing.assert_array_equal(_stable_transition(sound, 100), sound)
    turned = np.linalg.eigvals(_stable_transition(2.0 * np.linalg.inv(sound), 100))
    assert np.abs(turned).max() < 1.0
    np.testing.assert_allclose(np.sort(np.angle(turned)), np.sort(np.angle(np.linalg.eigvals(np.linalg.inv(sound)))))


def test_a_log_that_is_too_short_gives_no_start() -> None:
    assert _hankel(np.zeros((9, 2)), 0, 5).shape == (10, 0)
    assert _hankel(np.arange(10.0)[:, None], 0, 5).tolist() == [[0.0], [1.0], [2.0], [3.0], [4.0]]
    assert subspace_starts(joined_outputs(in_scale(20)), 3) == []


def test_steady_outputs_and_their_deviations_are_converted_from_scaled_to_physical_units() -> None:
    u_mean, u_std = np.array([3.0, -40.0]), np.array([2.0, 5.0])
    y_mean, y_std = np.array([1.0, 7.0]), np.array([0.5, 20.0])
    in_units = SYSTEM.in_units(u_mean, u_std, y_mean, y_std)
    for inputs in (np.zeros(M), np.array([10.0, -3.0])):
        seen, told = (_at_rest(SYSTEM, (inputs - u_mean) / u_std), _at_rest(in_units, inputs))
        np.testing.assert_allclose(told[0], y_mean + y_std * seen[0])
        np.testing.assert_allclose(told[1], y_std * seen[1])


def _at_rest(one: StateSpace, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the outputs at rest, and their deviations."""
    found, slopes = (part.real for part in one.response(1.0))
    by = np.tensordot(slopes, inputs, axes=(1, 0))
    by[:, -P:] += np.eye(P)
    return one.level + found @ inputs, np.sqrt(np.einsum("oi,ij,oj->o", by, one.covariance, by))
