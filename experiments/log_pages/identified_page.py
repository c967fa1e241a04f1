"""The page of an identified model: its quality, its uses, its charts, and its numbers to download."""

import math
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from estimation.finding import NORMAL_95
from experiments.command.json_output import json_text
from experiments.log_pages.identified_charts import (
    MeasuredCurve,
    bode_charts,
    measured_curve,
    residual_charts,
    run_charts,
    step_charts,
)
from experiments.log_pages.identified_files import control_text, matlab_text
from experiments.log_pages.identified_view import AS_LOGGED, IdentifiedView
from experiments.log_pages.identified_words import answer_of, notes_of, tests_of, title_of, uses_of
from experiments.page.numbers import MISSING, number, with_equal_decimals
from experiments.page.render import render_page
from experiments.page.tables import Column, right_aligned


def identified_page(view: IdentifiedView) -> str:
    """Return the page of an identified model."""
    result, stem = view.result, Path(str(view.result["file"]).split(", ")[0]).stem
    measured = measured_curve(view)
    good, bad = uses_of(view, measured)
    runs = bool(np.isfinite(view.simulated).any())
    bode = bode_charts(view, measured, stem)
    charts = {"run": run_charts(view, stem), **({} if bode is None else {"bode": bode})}
    if runs:
        charts |= {"residual": residual_charts(view, stem), "step": step_charts(view, stem)}
    place = (
        "place in the s plane [1/s]" if view.linear is not None and view.linear.continuous else "place in the z plane"
    )
    rows = list(_roots(view))
    shown = {
        "values": (
            "quantity",
            Column("value", words=right_aligned),
            Column("interval", "95 % interval", words=right_aligned),
        ),
        "roots": (
            "root",
            Column("place", place, words=right_aligned),
            Column("deviation", "standard deviation", words=right_aligned),
            Column("frequency", "natural frequency", "Hz", words=right_aligned),
            Column("damping", words=right_aligned),
            Column("lasts", "time constant", "s", words=right_aligned),
        ),
    }
    facts = {
        "result": result,
        "file": result["file"],
        "title": title_of(view),
        "answer": answer_of(view),
        "good": good,
        "bad": bad,
        "runs": runs,
        "tests": tests_of(view),
        "has_bode": bode is not None,
        "bode_words": _bode_words(view, measured),
        "step_words": _step_words(view),
        "charts": charts,
        "notes": notes_of(view),
        "values": pd.DataFrame(list(_values(view)), columns=["quantity", "value", "interval"]),
        "roots": pd.DataFrame(rows, columns=["root", "place", "deviation", "frequency", "damping", "lasts"]),
        "downloads": list(_downloads(view, stem)),
    }
    return render_page("log_pages/identified.html", facts, shown, {})


def _step_words(view: IdentifiedView) -> str:
    if view.linear is not None:
        return "Shaded: 95 % interval, if the model's structure is right."
    if view.is_linear:
        return "Without an interval: the fit gives no covariance."
    return "The model is not linear: another height of the step has another shape."


def _bode_words(view: IdentifiedView, measured: MeasuredCurve | None) -> str:
    said = ["Model with its 95 % band (shaded)." if view.linear is not None else ""]
    if measured is not None:
        said.append(
            "Dots: the response measured in this log, where it is known to half of its gain (95 % circle)."
            if view.is_linear
            else "The response measured in this log; the model is not linear and has none of its own."
        )
    return " ".join(one for one in said if one)


def _values(view: IdentifiedView) -> Iterator[tuple[str, str, str]]:
    """Yield table rows with quantity, value and interval."""
    result, out = view.result, view.output
    yield "fit, held-back data [%]", _percent(result["held_back_percent"]), MISSING
    yield "fit, data of the fit [%]", _percent(result["fit_percent"]), MISSING
    if result.get("test"):
        yield f"fit, {', '.join(result['test']['files'])} [%]", _percent(result["test"]["fit_percent"]), MISSING
    if result.get("one_step_percent") is not None:
        yield "fit, one sample ahead [%]", _percent(result["one_step_percent"]), MISSING
    unit = "" if out.unit == AS_LOGGED else f" [{out.unit}]"
    if result["rmse"] is not None:
        yield f"rms error, data of the fit{unit}", number(out.scale * result["rmse"]), MISSING
    yield from _gains(view)
    bandwidth, std = result.get("bandwidth_hz"), result.get("bandwidth_std_hz")
    if bandwidth is not None:
        ends = None if std is None else [bandwidth - NORMAL_95 * std, bandwidth + NORMAL_95 * std]
        yield ("bandwidth (-3 dB) [Hz]", *_value_and_interval(bandwidth, ends))
    for name, one in (result.get("nonlinearity") or {}).items():
        if isinstance(one, Mapping):
            yield (name.removesuffix("_s").replace("_", " "), *_value_and_interval(one["value"], one.get("ci95")))
    delay = result.get("delay") or {}
    if delay.get("seconds") is not None:
        late = delay["seconds"] if isinstance(delay["seconds"], list) else [delay["seconds"]]
        yield "dead time [ms]", ", ".join(number(1e3 * one) for one in late), MISSING
    yield "sample time [ms]", number(1e3 * view.sample_time), MISSING


def _gains(view: IdentifiedView) -> Iterator[tuple[str, str, str]]:
    gain = view.result.get("dc_gain")
    if not gain or gain.get("value") is None:
        return
    values = gain["value"] if isinstance(gain["value"], list) else [gain["value"]]
    stds = gain.get("std")
    spreads = stds if isinstance(stds, list) else [stds] * len(values)
    for k, (value, std) in enumerate(zip(values, spreads, strict=True)):
        ends = gain.get("ci95") or (None if not std else [value - NORMAL_95 * std, value + NORMAL_95 * std])
        which = "" if len(values) == 1 else f" from {view.inputs[k].name}"
        scale, unit = view.gain_unit(k)
        told = None if ends is None else [scale * end for end in ends]
        yield (
            f"steady gain{which}{'' if unit == AS_LOGGED else f' [{unit}]'}",
            *_value_and_interval(scale * value, told),
        )


def _value_and_interval(value: float, ends: Sequence[float] | None) -> tuple[str, str]:
    told = None if ends is None or not all(map(math.isfinite, ends)) else ends
    shown, *both = with_equal_decimals(value, told, "")
    return shown, " to ".join(both) or MISSING


def _percent(value: float | None) -> str:
    return MISSING if value is None or not math.isfinite(value) else f"{value:.1f}".replace("-", "\N{MINUS SIGN}")


def _roots(view: IdentifiedView) -> Iterator[tuple[str, ...]]:
    """Yield poles and zeros; a complex pair shares one row."""
    continuous = view.linear is not None and view.linear.continuous
    for name in ("pole", "zero"):
        for one in view.result.get(f"{name}s") or ():
            if one["imag"] < 0.0:
                continue
            pair = one["imag"] > 0.0
            place = number(one["real"]) + (f" ± {number(one['imag'])} j" if pair else "")
            stds = [one[part] for part in (("real_std", "imag_std") if pair else ("real_std",))]
            known = all(std is not None and math.isfinite(std) for std in stds)
            spread = (number(stds[0], 2) + (f", {number(stds[1], 2)} j" if pair else "")) if known else MISSING
            z = complex(one["real"], one["imag"])
            yield (
                f"{name} pair" if pair else name,
                place,
                spread,
                *_time_characteristics(z, view.sample_time, continuous),
            )


def _time_characteristics(root: complex, sample_time: float, continuous: bool) -> tuple[str, str, str]:
    """Return natural frequency [Hz], damping and time constant [s] of a root, as far as they are defined."""
    if not continuous and root == 0.0:
        return MISSING, MISSING, MISSING
    s = root if continuous else complex(np.log(root)) / sample_time
    size = abs(s)
    if size == 0.0:
        return "0", MISSING, MISSING
    lasts = MISSING if s.real >= 0.0 else number(-1.0 / s.real, 3)
    return number(size / (2.0 * math.pi), 3), number(-s.real / size, 3), lasts


def _downloads(view: IdentifiedView, stem: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, address and description of each download; the address contains the file itself."""
    yield f"{stem}-model.json", _address(json_text([view.result]), "application/json"), "the model as JSON"
    if view.is_linear:
        yield f"{stem}-model.py", _address(control_text(view), "text/x-python"), "a Python file for python-control"
        name = re.sub(r"[^A-Za-z0-9_]", "_", f"model_of_{stem}")  # what MATLAB can run is named like a variable
        yield f"{name}.m", _address(matlab_text(view), "text/x-matlab"), "a script for MATLAB"


def _address(text: str, kind: str) -> str:
    return f"data:{kind};base64,{b64encode(text.encode()).decode('ascii')}"
