"""A plant that integrates is fitted with a pole at 1, and its free run does not drift off."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import identify, linear_comparison
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.integrating import POLE_RECORDS, fit_integrating, refitted_linear
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.model.recursion import filtered
from plant.errors import LogWarning

N, F = 400, np.convolve([1.0, -0.8], [1.0, -1.0])
NOISE = 0.05 * np.random.default_rng(7).normal(size=(2, N))


def levels(seed: int, n: int = N) -> Array:
    """Return steps about a mean that is not zero, so that the output contains a ramp."""
    return 0.3 + np.repeat(np.random.default_rng(seed).normal(size=n // 10 + 1), 10)[:n]


def driven(u: Array, start: float) -> Array:
    """Return the sum of a velocity that is zero at an input of 0.1."""
    return start + filtered([0.0, 0.05, 0.02], F, u - 0.1)


@pytest.fixture(scope="module", params=[1, 2])
def data(request: pytest.FixtureRequest) -> Channels:
    u = [levels(seed) for seed in range(request.param)]
    y = [driven(one, 3.0 * k) + noise for k, (one, noise) in enumerate(zip(u, NOISE, strict=False))]
    return channels_from([one[:, None] for one in u], y, 1.0, ["u"], "y")


def test_an_integrating_fit_keeps_the_initial_level_over_twenty_records(data: Channels) -> None:
    inside, by = scaled(data)
    fit = fit_integrating(Form(2, (2,), (1,)), inside, [F], search=True)
    assert fit.integrates
    noise = float(np.sum(NOISE[: len(data.y)] ** 2))
    assert 0.95 * noise < fit.cost * by.y_std**2 < noise
    poles = np.sort(np.roots(fit.f))
    assert poles[0] == pytest.approx(0.8, abs=0.03)
    assert poles[1] == pytest.approx(1.0 - 1.0 / (POLE_RECORDS * N), abs=1e-9)
    # a run over twenty records from the true start: with a time constant of three records, the start would be lost
    u = levels(9, 20 * N)
    y = (driven(u, 0.0) - by.y_mean) / by.y_std
    known = np.where(np.arange(y.size) < N, y, np.nan)
    ran = LinearDynamics.of(fit).run((u[:, None] - by.u_mean) / by.u_std, known)
    assert np.std(ran - y) < 0.05 * np.std(y)


def test_an_integrating_fit_to_other_data_integrates_too(data: Channels) -> None:
    inside, _ = scaled(data)
    fit = fit_integrating(Form(1, (3,), (1,)), inside, [np.array([1.0, -0.99])])
    mask = [np.arange(N) // 80 == 2 for _ in data.y]
    other = refitted_linear(fit, inside.without(mask))
    assert other.integrates
    assert other.cost < fit.cost
    assert other.f == pytest.approx(fit.f, abs=1e-12), "one pole alone, and it is given"


def test_a_model_whose_final_fit_diverges_is_kept_as_it_was_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    u = levels(3)
    data = channels_from([u[:, None]], [driven(u, 1.0) + NOISE[0]], 1.0, ["u"], "y")
    lost = lambda fit, _: replace(fit, theta=np.zeros(fit.theta.size), cost=float("inf"))  # noqa: E731 -- used once
    monkeypatch.setattr(linear_comparison, "refitted_linear", lost)
    with pytest.warns(LogWarning, match="integrates its input"):
        found = identify.identify_channels(data, order=2, delay=1)
    assert found.sound
    assert found.quality.fit_percent > 90.0
