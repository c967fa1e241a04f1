"""An identified linear model as a file that builds it in another program: python-control, MATLAB."""

from collections.abc import Iterable, Sequence

import numpy as np

from experiments.command.visible_text import visible_name
from experiments.log_pages.identified_view import IdentifiedView
from experiments.log_pages.identified_words import has_limits
from plant.arrays import Array


def control_text(view: IdentifiedView) -> str:
    """Return a Python file that builds the model as a python-control object."""
    numerators, denominators, clock = _transfer_functions(view)
    linear = view.linear
    late = linear is not None and linear.continuous and linear.dead_time
    told = [f"Its dead time of {linear.dead_time!r} s is left out."] if linear is not None and late else []
    return (
        f"{_heading('#', view, told)}import control\n\n"
        "model = control.TransferFunction(\n"
        f"    [{_python_rows(numerators)}],\n    [{_python_rows(denominators)}],\n    {clock!r},\n"
        f"    inputs={list(view.names)!r},\n    outputs={[view.result['output']]!r},\n)\n"
    )


def matlab_text(view: IdentifiedView) -> str:
    """Return a MATLAB script that builds the model as a transfer function, with its dead time."""
    numerators, denominators, clock = _transfer_functions(view)
    linear = view.linear
    late = linear.dead_time if linear is not None and linear.continuous else 0.0
    about = f", 'InputDelay', {late!r}" if late else ""
    form = f"{clock!r}, 'Variable', 'z^-1'" if clock else "'Variable', 's'"
    return (
        f"{_heading('%', view, [])}model = tf({_matlab_rows(numerators)}, {_matlab_rows(denominators)}, ...\n"
        f"    {form}{about});\n"
        f"model.InputName = {{{', '.join(map(_matlab_name, view.names))}}};\n"
        f"model.OutputName = {_matlab_name(str(view.result['output']))};\n"
    )


def _transfer_functions(view: IdentifiedView) -> tuple[list[Array], list[Array], float]:
    """Return numerators and denominators, one for each input, and the sample time [s]; 0 for a continuous model."""
    linear = view.linear
    if linear is not None and linear.continuous:
        return [linear.numerator], [linear.denominator], 0
    length = max(max(b.size, f.size) for b, f in view.transfers)
    numerators, denominators = (
        [np.pad(one, (0, length - one.size)) for one in each] for each in zip(*view.transfers, strict=True)
    )
    return numerators, denominators, view.sample_time


def _heading(mark: str, view: IdentifiedView, more: Iterable[str]) -> str:
    """Return comments on where the model is from, and on what a transfer function leaves out."""
    offset = view.result.get("offset")
    told = [f"Identified by Hydrostate from {view.result['file']!r}.", *more]
    told += [f"The output also has an offset of {offset!r}, which a transfer function leaves out."] if offset else []
    told += ["The output also has limits, which a transfer function leaves out."] if has_limits(view) else []
    if view.result.get("error_model"):
        told.append("The model also has an error model, which a transfer function leaves out.")
    return "".join(f"{mark} {one}\n" for one in told)


def _python_rows(rows: Sequence[Array]) -> str:
    return f"[{', '.join(repr(row.tolist()) for row in rows)}]"


def _matlab_rows(rows: Sequence[Array]) -> str:
    return f"{{{', '.join(repr(row.tolist()) for row in rows)}}}"


def _matlab_name(name: str) -> str:
    return f"'{visible_name(name).replace(chr(39), 2 * chr(39))}'"
