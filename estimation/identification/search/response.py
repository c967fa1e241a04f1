"""One experiment through ``B/F``, and the signals whose shifts are its sensitivities, compiled."""

from estimation.arrays import Array
from estimation.identification.search.jit import compiled

DECAYED_SHARE = 1e-18
"""An initial state is left out of the sums once its response has decayed to this share."""


@compiled
def impulse_response(f: Array, n: int, n_s: int, pad: int, pulse: Array) -> int:
    """Fill ``1/F``'s impulse response behind so many zeros, and return how far an initial state is felt.

    Parameters
    ----------
    f : ndarray, shape (n_f,)
        Denominator behind its 1.
    pulse : ndarray, shape (pad + n,) or longer
        Receives the response.
    """
    if n_s == 0:
        return 0
    alive, t, largest = 1.0, 0, 1.0
    while t < n and alive > DECAYED_SHARE * largest:
        value = 1.0 if t == 0 else 0.0
        for j in range(f.size):
            value -= f[j] * pulse[pad + t - 1 - j]
        pulse[pad + t] = value
        # a resonance passes through zero, so all of the last samples, one more than the order, must have died out
        alive = 0.0
        for j in range(f.size + 1):
            alive = max(alive, abs(pulse[pad + t - j]))
        largest = max(largest, alive)
        t += 1
    n_pulse = min(n, t + n_s)
    for i in range(t, n_pulse):
        pulse[pad + i] = 0.0
    return n_pulse


@compiled
def respond(
    b: Array, f: Array, delay: int, state: Array, u: Array, pad: int, signals: Array, n_pulse: int, simulated: Array
) -> None:
    """Simulate an experiment.

    Parameters
    ----------
    b, f, state : ndarray, shapes (n_b,), (n_f,) and (n_s,)
        Numerator, denominator behind its 1, initial state.
    delay, pad, n_pulse : int
        Dead time, leading zeros of the signals, and as `impulse_response` returns it [samples].
    u : ndarray, shape (n,)
        Input.
    signals : ndarray, shape (3, pad + n) or longer
        Impulse response of ``1/F``; receives ``u/F`` and ``w/F``, w the model's output.
    simulated : ndarray, shape (n,) or longer
        Receives w.
    """
    pulse, filtered_u, filtered_w = signals[0], signals[1], signals[2]
    for t in range(u.size):
        value = u[t]
        for j in range(f.size):
            value -= f[j] * filtered_u[pad + t - 1 - j]
        filtered_u[pad + t] = value
        output = 0.0
        for k in range(b.size):
            output += b[k] * filtered_u[pad + t - delay - k]
        if t < n_pulse:
            for k in range(state.size):
                output += state[k] * pulse[pad + t - k]
        simulated[t] = output
        value = output
        for j in range(f.size):
            value -= f[j] * filtered_w[pad + t - 1 - j]
        filtered_w[pad + t] = value
