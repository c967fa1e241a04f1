"""Blocks of the diaphragm-motor paper's loop, section 5: noise, relay, delay and PID, and a loop around a linear model.

The relay also serves to identify: a loop closed by it oscillates at the frequency at which the model and its delay have
a phase of half a turn, with an amplitude that gives the gain there (Åström and Hägglund 1984, Automatica 20, 645).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, pi
from typing import TypeAlias, TypeVar

import numpy as np
from scipy.signal import cont2discrete

from plant.arrays import Array
from plant.errors import RigError
from plant.motor_paper.vibration_model import Matrices

Memory = TypeVar("Memory")

Controller: TypeAlias = Callable[[Memory, float], tuple[float, Memory]]
"""``controller(memory, error) -> (command, memory)``."""


def band_limited_noise(rng: np.random.Generator, count: int, sample_time: float, density: float) -> Array:
    """Return white noise of a given spectral density, as the noise block of section 5 generates it.

    Parameters
    ----------
    count : int
        Number of samples.
    sample_time : float
        Time between samples [s].
    density : float
        Two-sided power spectral density [unit squared over Hz].

    Returns
    -------
    ndarray, shape (count,)
        Noise whose variance is density over sample time.
    """
    return rng.normal(0.0, np.sqrt(density / sample_time), count)


def relay(was_high: bool, error: float, width: float = 0.0) -> bool:
    """Return whether a relay with hysteresis is high, section 5.

    Parameters
    ----------
    error : float
        Its input, in any unit.
    width : float
        It switches at plus and minus half of this [the error's unit].

    Examples
    --------
    >>> relay(False, 0.4, 1.0), relay(False, 0.6, 1.0), relay(True, -0.4, 1.0)
    (False, True, True)
    """
    return error > (-0.5 * width if was_high else 0.5 * width)


@dataclass(frozen=True)
class Pid:
    """A PID controller with a filtered derivative, limits, and an integral that stops while a limit is active.

    Parameters
    ----------
    proportional : float
        Gain [any unit].
    integral : float
        Gain of the integral, per second [1/s times the gain's unit].
    derivative : float
        Gain of the derivative [s times the gain's unit].
    filter_time : float
        Time constant of the derivative's filter [s].
    low, high : float
        Limits of the command [its unit].

    Raises
    ------
    RigError
        If a gain is not finite, the filter time negative, or the limits do not rise.
    """

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    filter_time: float = 0.0
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        if not all(isfinite(gain) for gain in (self.proportional, self.integral, self.derivative)):
            raise RigError(f"gains must be finite, got {self.proportional}, {self.integral}, {self.derivative}")
        if self.filter_time < 0.0 or not self.low < self.high:
            raise RigError(
                "filter_time must not be negative and low must be below high, "
                f"got {self.filter_time}, {self.low} and {self.high}"
            )


@dataclass(frozen=True)
class PidMemory:
    """Memory of a PID controller.

    Parameters
    ----------
    integral : float
        Integral part of the command [its unit].
    error : float
        The last error, filtered for the derivative [its unit].
    """

    integral: float = 0.0
    error: float = 0.0


def pid_step(pid: Pid, memory: PidMemory, error: float, sample_time: float) -> tuple[float, PidMemory]:
    """Return a PID controller's command, section 5.

    Parameters
    ----------
    error : float
        Reference minus measurement, in any unit.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    float
        Command, in its unit.
    PidMemory
        What it remembers next.

    Examples
    --------
    >>> pid_step(Pid(2.0, 10.0, high=1.0), PidMemory(), 0.5, 0.1)
    (1.0, PidMemory(integral=0.0, error=0.5))
    """
    filtered = memory.error + (error - memory.error) * sample_time / (sample_time + pid.filter_time)
    integral = memory.integral + pid.integral * error * sample_time
    slope = (filtered - memory.error) / sample_time
    wanted = pid.proportional * error + integral + pid.derivative * slope
    command = min(max(wanted, pid.low), pid.high)
    winding = (wanted - command) * error * pid.integral > 0.0
    return command, PidMemory(memory.integral if winding else integral, filtered)


@dataclass(frozen=True)
class LoopRun:
    """A run of a closed loop.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Sample times [s].
    command : ndarray, shape (n,)
        The controller's command, in the model's input unit.
    output : ndarray, shape (n,)
        The model's output without noise, in its unit.
    measured : ndarray, shape (n,)
        The measurement that the controller receives, in the output's unit.
    """

    time: Array
    command: Array
    output: Array
    measured: Array


def run_loop(
    matrices: Matrices,
    controller: Controller[Memory],
    memory: Memory,
    reference: Array,
    sample_time: float,
    *,
    delay: int = 0,
    noise: Array | None = None,
) -> LoopRun:
    """Run a controller on a linear model from rest; the command is held between samples and delayed by whole samples.

    Parameters
    ----------
    matrices : tuple of ndarray
        A, B, C, D of the model, one input and one output (equation 13).
    controller : callable
        ``controller(memory, error) -> (command, memory)``.
    reference : ndarray, shape (n,)
        Desired output, in its unit.
    sample_time : float
        Time between samples [s].
    delay : int
        Delay of the command in samples.
    noise : ndarray, shape (n,), optional
        Added to the measurement, in the output's unit.
    """
    A, B, C, _, _ = cont2discrete(matrices, sample_time)
    n = reference.shape[0]
    added = np.zeros(n) if noise is None else noise
    x, late = np.zeros(A.shape[0]), deque([0.0] * delay)
    command, output = np.zeros(n), np.zeros(n)
    row, column = C[0], B[:, 0]
    for k in range(n):
        output[k] = row @ x
        command[k], memory = controller(memory, float(reference[k] - output[k] - added[k]))
        late.append(command[k])
        x = A @ x + column * late.popleft()
    return LoopRun(sample_time * np.arange(n), command, output, output + added)


def ultimate_point(run: LoopRun, amplitude: float) -> tuple[float, float]:
    """Return the gain and frequency at which a proportional loop would oscillate for ever, from a relay's loop.

    Parameters
    ----------
    run : LoopRun
        A run with reference zero; only its second half is used.
    amplitude : float
        The relay's amplitude [the command's unit].

    Returns
    -------
    float
        Ultimate gain, by the describing function 4 d/(pi a), in the command's unit over the output's.
    float
        Ultimate frequency [Hz].

    Raises
    ------
    RigError
        If the second half of the run holds fewer than two whole periods.
    """
    half = run.output.shape[0] // 2
    time, output = run.time[half:], run.output[half:]
    rises = np.flatnonzero((output[:-1] < 0.0) & (output[1:] >= 0.0))
    if rises.shape[0] < 3:
        raise RigError(f"a relay's loop must hold two periods in its second half, got {max(rises.shape[0] - 1, 0)}")
    share = -output[rises] / (output[rises + 1] - output[rises])
    crossings = time[rises] + share * (time[1] - time[0])
    frequency = (crossings.shape[0] - 1) / (crossings[-1] - crossings[0])
    whole = slice(rises[0], rises[-1] + 1)
    turned = np.exp(-2j * pi * frequency * time[whole])
    first = 2.0 * abs(np.mean(output[whole] * turned))
    return 4.0 * amplitude / (pi * float(first)), float(frequency)
