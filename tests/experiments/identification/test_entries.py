"""Entries of the JSON contract keep their types, whatever the model contains."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run.data import Scaling, channels_from
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.limited_output import Limits
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from experiments.identification.entries import column_entries, gains_shown


@pytest.fixture(scope="module")
def found() -> Identified:
    """Return a linear model with one input."""
    rng = np.random.default_rng(0)
    u = rng.normal(size=300)
    y = filtered(np.array([0.0, 0.0, 0.2]), np.array([1.0, -0.9]), u) + 0.01 * rng.normal(size=300)
    return identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=2)


def stopped(found: Identified, inputs: tuple[str, ...]) -> Identified:
    """Return a model with a gain of 2 from each input whose output is limited by stops."""
    form = Form(1, (1,) * len(inputs), (2,) * len(inputs))
    by = Scaling(np.zeros(len(inputs)), np.ones(len(inputs)), 0.0, 1.0)
    theta = np.array([*[0.2] * len(inputs), -0.9, 0.0])
    dynamics = LimitedDynamics(form, theta, Limits(-0.5, 0.5, 0.01, stops=True))
    return replace(found, model=FreeRunModel(inputs, "y", 0.01, "output-error", by, dynamics), gain_std=())


def test_a_model_with_end_stops_has_the_same_entry_types_as_a_linear_one(found: Identified) -> None:
    linear, limited = column_entries(found), column_entries(stopped(found, ("u",)))
    assert limited["dc_gain"] == {"value": pytest.approx(2.0), "std": None}
    assert limited["numerator"] == [0.0, 0.0, 0.2]
    assert limited["delay"] == linear["delay"] == {"samples": 2, "seconds": 0.02}
    (pole,) = limited["poles"]
    assert set(pole) == set(linear["poles"][0])
    assert (pole["real"], pole["real_std"]) == (pytest.approx(0.9), None)
    assert gains_shown(limited) == "2"


def test_gains_of_several_inputs_are_given_without_standard_deviation(found: Identified) -> None:
    limited = column_entries(stopped(found, ("u", "v")))
    assert limited["dc_gain"] == {"value": pytest.approx([2.0, 2.0]), "std": None}
    assert gains_shown(limited) == "2 2"


def test_the_message_of_a_mismatch_contains_the_note_against_the_model(found: Identified) -> None:
    swapped = IdentificationCode.SWAPPED.note(input="u", output="y", back=0.1, left=0.4)
    other = IdentificationCode.NO_NONLINEARITY.note(output="y")
    doubted = replace(found, notes=(other, swapped), sound=False)
    assert str(swapped) in column_entries(doubted)["message"]
