"""Structures that are not fitted by their free run: they get an offset, and are judged by the free run."""

from dataclasses import replace
from typing import Any

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.choose import fit_structure
from estimation.identification.fit.residual_tests import contrast_test
from estimation.identification.free_run.choose_linear import Candidate, slowest_pole
from estimation.identification.free_run.data import Channels, Scaling, in_scale
from estimation.identification.free_run.held_back import block_error
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_comparison import LinearComparison, closed_loop_notes
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.notes import GAIN_MEANS_NOTHING, IdentificationCode
from estimation.identification.structure_names import STRUCTURE_NAMES
from plant.errors import HydrostateError
from plant.notes import Note

OTHER_STRUCTURES = {name: structure for name, structure in STRUCTURE_NAMES.items() if name != "output-error"}
"""Structures that are not fitted by their free run, by their names in the command line."""

NOISE_MODELS = ("arx", "armax", "box-jenkins")
"""Structures that assume something of the noise; they may hold in a closed loop."""

WITH_OFFSET = ("arx", "instrumental", "continuous")
"""Structures whose offset is fitted along. Where a noise model is fitted, too, it goes to a zero at 1 beside an offset
(as of a differenced series), and intervals of a short record become too narrow."""

CONTRAST_PROBABILITY = 1e-3
"""Probability below which a structure and output error are held to differ; behind noise as assumed, none
of 150 fits of ARX came below, as the test adds both covariances."""

HELD_BACK = 1.0 / 3.0
"""Last share of every log that is held back to judge the structure."""


def identified_other_structure(structure: str, compared: LinearComparison) -> Identified:
    """Return a structure that is not fitted by its free run, at the order of the best output-error model.

    What was told of the data holds for it, too: a steady gain that means nothing, a closed loop, swapped columns.

    Parameters
    ----------
    structure : str
        One of `OTHER_STRUCTURES`.

    Raises
    ------
    HydrostateError
        As `fit_other_structure`.
    """
    data, by, best = compared.task.data, compared.task.by, compared.best
    dynamics, linear, held_back = fit_other_structure(structure, best.form, data, by)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, structure, by, dynamics, linear)
    quality = model.quality(data.u, data.y)
    sound = compared.related and quality.fit_percent > 0.0 and held_back < 1.0
    if not compared.related:
        notes = [*compared.notes]
    else:
        notes = [note for note in compared.notes if note.code in GAIN_MEANS_NOTHING]
        sound &= best.doubt != "time_constant"
    radius, samples = slowest_pole(dynamics.f), compared.task.part.informative_samples
    if not notes and radius > np.exp(-1.0 / samples):
        slowest = -data.sample_time / float(np.log(radius)) if radius < 1.0 else float("inf")
        told = {"time_constant_s": slowest, "duration_s": samples * data.sample_time}
        notes.append(IdentificationCode.TIME_CONSTANT_BEYOND_RECORD.note(order=best.form.order, **told))
        sound = False
    ahead = (IdentificationCode.SWAPPED, IdentificationCode.INPUT_LOGGED_LATE)
    held = structure in NOISE_MODELS  # in a closed loop, as far as it has a delay
    without_delay = (IdentificationCode.FEEDBACK_AT_ONCE, IdentificationCode.REGULATED)
    shared = (*ahead, *(() if best.form.delays[0] else without_delay))
    closed = [one for one in closed_loop_notes(model, data) if not held or one.code in shared]
    sound &= not any(note.code in ahead for note in closed)
    notes += closed
    if structure in NOISE_MODELS and not notes:
        notes += _contrast_notes(linear, best, compared.task.whole, by)
    if not (quality.fit_percent > 0.0 and held_back < 1.0):
        notes.append(IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent))
    return Identified(model, quality, 100.0 * (1.0 - held_back), tuple(compared.rows), tuple(notes), sound)


def _contrast_notes(model: LinearModel, best: Candidate, whole: Channels, by: Scaling) -> list[Note]:
    """Return a note if a fit differs from that of output error by more than both uncertainties."""
    found = contrast_test(model, linear_model(refitted_linear(best.fit, whole), whole, by))
    if not found.p_value < CONTRAST_PROBABILITY:
        return []
    named = {"structure": model.structure, "output": model.output_name}
    return [IdentificationCode.NOISE_ASSUMED.note(**named, p_value=found.p_value)]


def fit_other_structure(
    name: str, form: Form, data: Channels, by: Scaling
) -> tuple[LinearDynamics, LinearModel, float]:
    """Fit a structure, and judge it by the free run on the last third of every log, fitted to the rest.

    Parameters
    ----------
    name : str
        One of `OTHER_STRUCTURES`.
    form : Form
        Order, size and dead time.
    data : Channels
        In the channels' units.

    Returns
    -------
    tuple of LinearDynamics, LinearModel and float
        The dynamics, the fit with its offset, and the held-back error over the output's deviation.

    Raises
    ------
    HydrostateError
        If there are several inputs, or as the fits.
    """
    if len(data.inputs) > 1:
        raise HydrostateError(f"structure {name} takes one input, got {', '.join(data.inputs)}: use output-error")
    model = _model_fit(name, form, data, by)
    dynamics, offset = _free_run_dynamics(model, data, by)
    cuts = [round(y.size * (1.0 - HELD_BACK)) for y in data.y]
    shorter = replace(
        data,
        u=tuple(u[:cut] for u, cut in zip(data.u, cuts, strict=True)),
        y=tuple(y[:cut] for y, cut in zip(data.y, cuts, strict=True)),
    )
    part, _ = _free_run_dynamics(_model_fit(name, form, shorter, by), shorter, by)
    whole = in_scale(data, by)
    errors, masks = list[Array](), list[BoolArray]()
    for u, y, cut in zip(whole.u, whole.y, cuts, strict=True):
        late = np.arange(y.size) >= cut
        errors.append(part.run(u, np.where(late, np.nan, y)) - y)
        masks.append(late & np.isfinite(y))
    held_back = block_error(np.concatenate(errors), np.concatenate(masks))
    level = by.y_mean + by.y_std * offset
    if not model.continuous:
        level -= model.dc_gain * float(by.u_mean[0])
    else:
        level -= float(model.numerator[-1] / model.denominator[-1]) * float(by.u_mean[0])
    return dynamics, replace(model, offset=level), held_back


def _model_fit(name: str, form: Form, data: Channels, by: Scaling) -> LinearModel:
    u = [one[:, 0] - by.u_mean[0] for one in data.u]
    y = [one - by.y_mean for one in data.y]
    if name in ("subspace", "instrumental") and any(np.isnan(one).any() for one in y):
        raise HydrostateError(f"structure {name} needs every sample of {data.output!r}: use output-error")
    if name == "subspace" and len(u) > 1:
        raise HydrostateError(f"structure subspace takes one log, got {len(u)}: use output-error")
    sizes = {"n_numerator": form.sizes[0], "n_denominator": form.order, "delay": form.delays[0]}
    about: dict[str, Any] = {"covariance": "auto", "input_name": data.inputs[0], "output_name": data.output}
    if name in WITH_OFFSET:
        about["estimate_offset"] = True
    both = (u[0], y[0]) if len(u) == 1 else (u, y)
    return fit_structure(OTHER_STRUCTURES[name], *both, data.sample_time, {**sizes, **about})


def _free_run_dynamics(model: LinearModel, data: Channels, by: Scaling) -> tuple[LinearDynamics, float]:
    """Return the free-run dynamics of a fit, with the offset that fits the data best."""
    if not model.is_stable:
        raise HydrostateError(
            f"the {model.structure} model of {data.output!r} is unstable and does not run free: use output-error"
        )
    one = model.discretised() if model.continuous else model
    b = one.numerator[one.delay :] * float(by.u_std[0]) / by.y_std
    form = Form(one.denominator.size - 1, (b.size,), (one.delay,))
    problem = Problem(form, in_scale(data, by))
    columns = problem.linear_columns(one.denominator)
    left = (problem.y - columns[:, : b.size] @ b)[problem.used]
    offset = float(np.linalg.lstsq(columns[:, b.size :][problem.used], left, rcond=None)[0][0])
    return LinearDynamics(form, np.concatenate([b, one.denominator[1:], [offset]])), offset
