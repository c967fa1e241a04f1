"""The loops of the watch are Python code; without compilation they give the same results, bit for bit."""

from types import ModuleType

import numpy as np
import pytest

from faults.watch import kernel, watch
from faults.watch.events import Alarm, Change, Event, Ready
from faults.watch.watch import Watch
from plant.eha.model import EhaParameters

P = EhaParameters()


def reversals(seconds: float, leak_from: float, T: float) -> np.ndarray:
    """Return an actuator that follows random reversals without delay and loses a third of its speed at some time."""
    rng = np.random.default_rng(2)
    count = round(seconds / T)
    speed = P.rated_speed * np.repeat(rng.choice((-1.0, 1.0), count // 25 + 1), 25)[:count]
    share = np.where(T * np.arange(count) < leak_from, 0.9, 0.6)
    position = np.cumsum(share * P.pump_displacement * speed / P.piston_area) * T
    noise = rng.standard_normal((count, 3))
    pressure = 1e6 * np.sign(speed)
    return np.column_stack([speed, position, pressure]) + noise * [0.05, 1e-6, 5e3]


def watched(samples: np.ndarray, T: float, *, pressure: bool) -> list[Event]:
    return Watch(P, T, pressure=pressure, learning=60.0).take(samples)


@pytest.mark.parametrize(("pressure", "T"), [(True, 2e-2), (False, 1e-2)])
def test_plain_python_and_the_compiled_kernel_give_the_same_events(
    monkeypatch: pytest.MonkeyPatch, pressure: bool, T: float
) -> None:
    samples = reversals(65.0, 62.0, T)
    samples[round(40.0 / T) : round(40.0 / T) + 10] = np.nan
    compiled = watched(samples, T, pressure=pressure)
    assert [type(event) for event in compiled] == [Ready, Alarm, Change]
    plain: ModuleType = kernel
    monkeypatch.setattr(watch, "watch_kernel", lambda: plain)
    assert watched(samples, T, pressure=pressure) == compiled
