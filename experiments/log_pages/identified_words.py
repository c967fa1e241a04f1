"""Sentences about an identified model: its quality, and what it may and may not be used for."""

import math

import numpy as np

from estimation.identification.notes import GAIN_MEANS_NOTHING, IdentificationCode
from estimation.log_checks.channel_names import SPEED, VELOCITY
from experiments.log_pages.identified_charts import MeasuredCurve
from experiments.log_pages.identified_view import AS_LOGGED, IdentifiedView, Signal
from experiments.page.numbers import number
from experiments.page.sentences import sentence

KINDS = {
    "output-error": "linear",
    "ARX": "linear, ARX",
    "ARMAX": "linear, ARMAX",
    "Box-Jenkins": "linear, Box-Jenkins",
    "SRIV": "linear, by instrumental variables",
    "subspace": "linear, by subspaces",
    "continuous": "linear, in continuous time",
    "narx": "polynomial, NARX",
    "hammerstein": "linear behind a nonlinear input",
    "wiener": "linear, whose output is measured without its sign",
    "state-space": "state space",
}
"""Model structures in words."""

ROUGH_FIT_PERCENT = 50.0
"""Fit on held-back data below which a simulation is called rough: over half of the deviation remains [%]."""

AGREEMENT_LIMIT = 0.3
"""Largest median distance from the measured response, relative to its gain, at which a controller may be designed
[fraction]. Judged: margins of 6 dB and 40 degrees can absorb it."""

NO_BREAK = "\N{NO-BREAK SPACE}"

SIGNIFICANCE_LEVEL = 0.05
"""Significance level of the residual tests [probability]."""

REASONS = {
    IdentificationCode.SWAPPED: "its input seems to answer its output",
    IdentificationCode.INPUT_LOGGED_LATE: "its input seems to be logged late",
    IdentificationCode.WALK_FOLLOWED: "it follows what the output does by itself",
    IdentificationCode.ANSWERS_LATE: "the output seems to answer later than this model does",
}
"""Reasons against a model, by the code of its note; they hold whatever its fit."""


def is_usable(view: IdentifiedView) -> bool:
    """Return whether the model may be used at all: it runs free, and does better than the mean on held-back data.

    If the output wanders by itself, the fit of a free run says nothing about the model.
    """
    held, own = view.result["held_back_percent"], view.result["fit_percent"]
    better = has_random_walk(view) or (own is not None and own > 0.0 and (held is None or held > 0.0))
    return better and view.result["outcome"] == "ok" and bool(np.isfinite(view.simulated).all())


def has_random_walk(view: IdentifiedView) -> bool:
    """Return whether the output wanders by itself, so that the model was fitted to its changes."""
    return IdentificationCode.RANDOM_WALK in {one["code"] for one in view.result.get("notes", ())}


def has_limits(view: IdentifiedView) -> bool:
    """Return whether the output is clipped or held by end stops."""
    return (view.result.get("nonlinearity") or {}).get("kind") in ("cut-off", "stops")


def title_of(view: IdentifiedView) -> str:
    """Return the verdict in one sentence."""
    held, own = view.result["held_back_percent"], view.result["fit_percent"]
    if not is_usable(view):
        return f"Do not use this model of {view.output.name}: {_why_unusable(view)}."
    order = view.result.get("order") or (None if view.linear is None else view.linear.denominator.size - 1)
    kind = "linear with limits" if has_limits(view) else KINDS.get(view.result["structure"], view.result["structure"])
    beside = ", with an error model" if view.result.get("error_model") else ""
    said = f"Model of {view.output.name} ({kind}{f', order {order}' if order else ''}{beside})"
    if has_random_walk(view):
        return f"{said}, fitted to changes: the output also wanders by itself."
    if held is None:
        return f"{said}: fit {own:.1f} % on the data of the fit; the log is too short to hold data back."
    return f"{said}: fit {held:.1f} % on data held back from the fit{_on_other_logs(view)}."


def _on_other_logs(view: IdentifiedView) -> str:
    """Return the fit on the logs of ``--validate``, to stand behind that on held-back data; empty without them."""
    test = view.result.get("test")
    if not test or not math.isfinite(test["fit_percent"]):
        return ""
    return f", {test['fit_percent']:.1f} % on {', '.join(test['files'])}"


def _why_unusable(view: IdentifiedView) -> str:
    if view.linear is not None and not view.linear.is_stable:
        return "it is unstable"
    held, own = view.result["held_back_percent"], view.result["fit_percent"]
    if not np.isfinite(view.simulated).all():
        return "its free run grows beyond bounds"
    told = {one["code"] for one in view.result.get("notes", ())}
    reason = next((words for code, words in REASONS.items() if code in told), None)
    if reason is not None:
        return reason
    if held is not None and held <= 0.0:
        return "on held-back data it is no better than the mean"
    if own is not None and own <= 0.0:
        return "it is no better than the mean"
    return "the log does not show that the output follows the input"


def answer_of(view: IdentifiedView) -> str:
    """Return the meaning of the number in the verdict, and the size of the error."""
    inputs = ", ".join(one.name for one in view.inputs)
    said = f"The model is simulated from {inputs} alone: it never sees the measured output. "
    error = _held_back_error(view)
    size = "" if error is None else f"{view.output.amount(number(error, 2))}{_unit_of(view.output)} (rms)"
    if has_random_walk(view):
        return f"{said}The error is about {size}, with what the output does by itself." if size else said.rstrip()
    said += "A fit of 100 % is perfect; 0 % is no better than the mean. "
    return f"{said}The error is about {size}." if size else said.rstrip()


def _unit_of(output: Signal) -> str:
    """Return the text shown for the unit of a column that has no known unit."""
    return f" in the unit of {output.name}" if output.unit == AS_LOGGED else ""


def _held_back_error(view: IdentifiedView) -> float | None:
    """Return the error of the free run on held-back data, or on all data if none was held back [shown unit]."""
    held = view.result["held_back_percent"]
    if held is None or not is_usable(view):
        own = view.result["rmse"]
        return None if own is None or not math.isfinite(own) else view.output.scale * own
    return view.output.scale * (1.0 - held / 100.0) * float(np.nanstd(view.y))


def determined_band(measured: MeasuredCurve | None) -> tuple[float, float] | None:
    """Return the longest range of frequencies in which the log determines the response [Hz]; None if there is none."""
    if measured is None or not measured.frequency.size:
        return None
    first, last = measured.frequency[measured.begins], measured.frequency[np.append(measured.begins[1:], 0) - 1]
    best: tuple[float, float] | None = None
    begin: float | None = None
    for low, high, known in zip(first.tolist(), last.tolist(), measured.known.tolist(), strict=True):
        begin = (low if begin is None else begin) if known else None
        if begin is not None and (best is None or high / begin > best[1] / best[0]):
            best = begin, high
    return best


def distance(view: IdentifiedView, measured: MeasuredCurve, band: tuple[float, float]) -> float:
    """Return the median distance between modelled and measured response, relative to the measured gain [fraction].

    Intervals of equal width on a logarithmic frequency axis have equal weight.

    Parameters
    ----------
    band : tuple of float
        Lowest and highest frequency to compare [Hz].

    Returns
    -------
    float
        The median over the intervals of the median in each [fraction].
    """
    there = (measured.frequency >= band[0]) & (measured.frequency <= band[1])
    part = MeasuredCurve(measured.frequency[there], measured.response[there], measured.radius[there])
    apart = np.abs(view.response(0, part.frequency) - part.response) / np.abs(part.response)
    return float(np.median([np.median(one) for one in np.split(apart, part.begins[1:])]))


def uses_of(view: IdentifiedView, measured: MeasuredCurve | None) -> tuple[list[str], list[str]]:
    """Return what the model may be used for, and what it may not, as sentences.

    Parameters
    ----------
    measured : MeasuredCurve or None
        The response measured from the log itself.
    """
    good: list[str] = []
    bad: list[str] = []
    usable = is_usable(view)
    if usable:
        ranges = " and ".join(f"{one.name} from {_range(one, view.u[:, k])}" for k, one in enumerate(view.inputs))
        held, own = view.result["held_back_percent"], view.result["fit_percent"]
        rough = "Rough simulation" if (own if held is None else held) < ROUGH_FIT_PERCENT else "Simulation"
        what = (
            f"Simulation of changes of {view.output.name}"
            if has_random_walk(view)
            else f"{rough} of {view.output.name}"
        )
        good.append(f"{what} by {ranges}.")
        bad.append("Inputs beyond that range: the log says nothing about them.")
        if has_random_walk(view):
            bad.append(f"The level of {view.output.name}: it also moves by itself.")
        if (view.result.get("test") or {}).get("clearly_worse"):
            bad.append(f"Logs like {', '.join(view.result['test']['files'])}: there, the model errs far more.")
    # the measured response includes samples at limits, but the transfer function describes the plant without them
    compared = usable and view.is_linear and not has_limits(view)
    band = determined_band(measured) if compared else None
    if band is not None and measured is not None:
        apart = distance(view, measured, band)
        said = f"{number(band[0], 2)} to {number(band[1], 2)} Hz"
        told = f"there, it differs from the measured response by {100.0 * apart:.0f} % (median)"
        if apart <= AGREEMENT_LIMIT:
            good.append(f"Controller design from {said}: {told}.")
            bad.append(f"Frequencies beyond {said}: the log does not tell the response there.")
        else:
            bad.append(
                f"Controller design: from {said}, it differs from the measured response by "
                f"{100.0 * apart:.0f} % (median)."
            )
    elif compared and len(view.inputs) == 1:
        bad.append("Controller design: the log tells the response at no frequency well enough to check the model.")
    if usable and has_limits(view):
        bad.append("Controller design without a check: the measured response holds samples at the limits.")
    bad += [*_gain_warnings(view), *_residual_warnings(view)]
    if (view.result["input"], view.result["output"]) == (SPEED, VELOCITY):
        bad.append("Diagnosis: the model does not tell leakage, friction and oil apart. Use hydrostate diagnose.")
    return good, bad


def _range(one: Signal, values: np.ndarray) -> str:
    low, high = (number(one.scale * end, 3) for end in (float(values.min()), float(values.max())))
    return f"{low} to {one.amount(high)}"


def _gain_warnings(view: IdentifiedView) -> list[str]:
    """Return why the steady gain must not be used; empty if it may be used."""
    codes = {one["code"] for one in view.result.get("notes", ())}
    gain = view.result.get("dc_gain")
    if codes & GAIN_MEANS_NOTHING:
        return ["Steady gain: the log does not determine it."]
    if not gain or view.linear is None:
        return []
    value, ends = gain["value"], gain.get("ci95")
    if ends is not None and value is not None and ends[0] <= 0.0 <= ends[1]:
        return ["Steady gain: its 95 % interval contains zero."]
    return []


def _residual_warnings(view: IdentifiedView) -> list[str]:
    """Return the warning against conclusions about the plant's structure, if the residual correlates with an input."""
    cross = view.cross_correlation_p
    if cross is None or cross >= SIGNIFICANCE_LEVEL:
        return []
    return [
        f"Conclusions about order and poles of the plant: the residual still follows the input "
        f"({p_value_text(cross)}), so the model lacks something, such as friction or a dead time."
    ]


def tests_of(view: IdentifiedView) -> str:
    """Return the results of the residual tests, as sentences; empty if none was made."""
    white, cross = view.whiteness_p, view.cross_correlation_p
    said: list[str] = []
    if white is not None and white < SIGNIFICANCE_LEVEL:
        linear = view.linear
        allowed = linear is not None and np.array_equal(linear.covariance, linear.covariance_robust)
        told = "; the intervals allow for that" if allowed else ""
        said.append(
            f"The residual is not white noise ({p_value_text(white)}): an error lasts over several samples{told}."
        )
    elif white is not None:
        said.append(f"The residual may be white noise ({p_value_text(white)}).")
    if cross is not None:
        left = "It still follows the input" if cross < SIGNIFICANCE_LEVEL else "Nothing of the input is left in it"
        said.append(f"{left} ({p_value_text(cross)}).")
    return " ".join(said)


def p_value_text(probability: float) -> str:
    """Return a p-value as text without line breaks; a tiny p-value is shown as an upper bound, never as 0.

    Parameters
    ----------
    probability : float
        The p-value [probability].

    Examples
    --------
    >>> [p_value_text(one).replace(NO_BREAK, " ") for one in (0.0, 0.02)]
    ['p < 0.001', 'p = 0.02']
    """
    return ("p < 0.001" if probability < 0.001 else f"p = {probability:.2g}").replace(" ", NO_BREAK)


def notes_of(view: IdentifiedView) -> list[str]:
    """Return the notes of a model as sentences."""
    return [sentence(one["text"]) for one in view.result.get("notes", ())]
