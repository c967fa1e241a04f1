"""Entries of the JSON contract for identified models: a transfer function, or a model between columns."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.command.terminal import clauses

if TYPE_CHECKING:
    from estimation.identification.free_run.identify import Identified
    from estimation.identification.free_run.model import FreeRunModel
    from estimation.identification.model.linear_model import LinearModel
    from estimation.identification.state_space.dynamics import StateSpaceDynamics

FORMAT_VERSION = 1
"""Version of a written library: later versions add entries and rename none."""


def linear_entries(model: "LinearModel") -> dict[str, Any]:
    """Return a transfer function under the names of the JSON contract."""
    bandwidth = model.bandwidth_hz
    extent = "not below the Nyquist frequency" if bandwidth is None else f"{bandwidth:.3g} Hz"
    return {
        "outcome": "ok",
        **model.to_dict(),
        "bandwidth_hz": bandwidth,
        "bandwidth_std_hz": model.bandwidth_std_hz,
        "poles": with_std(model.poles, model.pole_std),
        "zeros": with_std(model.zeros, model.zero_std),
        "format_version": FORMAT_VERSION,
        "delay": {"samples": model.delay, "seconds": model.delay * model.sample_time},
        "message": (
            f"{model.structure} of order {model.denominator.size - 1}, fit {model.fit_percent:.1f} %, "
            f"gain {gain_shown(model.dc_gain, model.dc_gain_std)}, bandwidth {extent}"
        ),
    }


def gains_shown(result: Mapping[str, Any]) -> str:
    """Return the steady gain from each input with one standard deviation; a smaller gain is marked "undetermined".

    Parameters
    ----------
    result : mapping
        Entries with ``dc_gain`` and ``notes``.
    """
    from estimation.identification.notes import GAIN_MEANS_NOTHING

    gain = result["dc_gain"]
    if gain is None or gain["value"] is None:
        return "-"
    values, spreads = gain["value"], gain.get("std") or 0.0
    values = [values] if isinstance(values, float) else values
    each = zip(values, spreads if isinstance(spreads, list) else [spreads] * len(values), strict=True)
    nothing = not GAIN_MEANS_NOTHING.isdisjoint(note["code"] for note in result.get("notes", ()))
    return " ".join("undetermined" if nothing else gain_shown(one, spread) for one, spread in each)


def gain_shown(value: float, std: float) -> str:
    """Return a gain with one standard deviation, if the gain exceeds it.

    Parameters
    ----------
    value, std : float
        Gain and standard deviation, zero if there is none [output unit / input unit].
    """
    if not std <= abs(value):
        return "undetermined"
    return f"{value:.4g} ± {std:.1g}" if std else f"{value:.4g}"


def with_std(roots: Any, spreads: Any) -> list[dict[str, float]]:
    """Return complex numbers with their standard deviations, under the names of the JSON contract."""
    return [
        {"real": float(r.real), "imag": float(r.imag), "real_std": float(s.real), "imag_std": float(s.imag)}
        for r, s in zip(roots, spreads, strict=True)
    ]


def column_entries(found: "Identified") -> dict[str, Any]:
    """Return a model between columns under the names of the JSON contract."""
    from estimation.identification.notes import RAISED_AS_WARNINGS, UNRELIABLE
    from estimation.identification.state_space.dynamics import StateSpaceDynamics

    model, linear = found.model, found.model.linear
    result: dict[str, Any] = {
        "outcome": "ok" if found.sound else "mismatch",
        "inputs": list(model.inputs),
        "input": model.inputs[0],
        "output": model.output,
        "structure": model.structure,
        "n_values": model.n_values,
        "sample_time_s": model.sample_time,
        **vars(found.quality),
        "held_back_percent": found.held_back_percent,
        "candidates": list(found.candidates),
        "model": model.to_dict(),
        "notes": [note.to_dict() for note in found.notes if note.code not in RAISED_AS_WARNINGS],
    }
    if linear is not None:
        result = {**linear_entries(linear), **result, "order": linear.denominator.size - 1, "offset": model.offset}
        result["dc_gain"] = {"value": linear.dc_gain, "std": linear.dc_gain_std}
    elif model.structure == "output-error":
        result |= _transfer_entries(model, found.gain_std)
    elif isinstance(model.dynamics, StateSpaceDynamics):
        result |= _state_space_entries(model, model.dynamics)
    result["nonlinearity"] = model.nonlinearity
    result["error_model"] = None if model.error_model is None else model.error_model.facts()
    quality, why = found.quality, sorted(found.notes, key=lambda note: note.code not in UNRELIABLE)
    named = model.structure + ("" if model.error_model is None else " with an error model")
    result["message"] = clauses(
        [
            f"{named}, {model.n_values} values: fit {quality.fit_percent:.1f} % running free, "
            f"{found.held_back_percent:.1f} % on blocks held back, rms error {quality.rmse:.4g}",
            *map(str, why[:1] if not found.sound else ()),
        ]
    )
    return result


def _transfer_entries(model: "FreeRunModel", gain_std: Sequence[float]) -> dict[str, Any]:
    """Return transfer functions without covariance: in the form of `linear_entries` for one input, else by inputs."""
    import numpy as np  # here, so that help texts appear without a slow import

    transfer = model.transfer_functions()
    f = transfer[0][1]
    numerators, gains = [b.tolist() for b, _ in transfer], [float(b.sum() / f.sum()) for b, _ in transfer]
    entries: dict[str, Any] = {"denominator": f.tolist(), "order": f.size - 1, "offset": model.offset}
    if len(transfer) > 1:
        return {**entries, "numerator": numerators, "dc_gain": {"value": gains, "std": list(gain_std) or None}}
    late = int(np.argmax(transfer[0][0] != 0.0))
    return {
        **entries,
        "numerator": numerators[0],
        "dc_gain": {"value": gains[0], "std": None},
        "poles": [
            {"real": float(one.real), "imag": float(one.imag), "real_std": None, "imag_std": None}
            for one in np.roots(f)
        ],
        "delay": {"samples": late, "seconds": late * model.sample_time},
    }


def _state_space_entries(model: "FreeRunModel", dynamics: "StateSpaceDynamics") -> dict[str, Any]:
    """Return order, poles, steady gains and dead time of one output of a state space."""
    system, gain = dynamics.system, model.scaling.y_std / model.scaling.u_std
    return {
        "order": system.order,
        "poles": with_std(system.poles, system.pole_std),
        "dc_gain": {
            "value": (system.dc_gain[dynamics.place] * gain).tolist(),
            "std": (system.dc_gain_std[dynamics.place] * gain).tolist(),
        },
        "offset": model.offset,
        "delay": {
            "samples": list(system.delays),
            "seconds": [delay * model.sample_time for delay in system.delays],
        },
    }
