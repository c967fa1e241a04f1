import warnings

import numpy as np
import pytest

from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.dropouts import dropped_value
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import LogWarning

COUNT = 600
RNG = np.random.default_rng(470)
INPUT = np.repeat(RNG.choice([-1.0, 1.0], COUNT // 10), 10)
OUTPUT = 5.0 + filtered([0.0, 0.1], [1.0, -0.9], INPUT) + 0.02 * RNG.standard_normal(COUNT)
LOST = RNG.random(COUNT) < 0.15


@pytest.mark.parametrize("value", [0.0, 6.5])
def test_an_output_that_drops_out_says_so_and_is_right_without(value: float) -> None:
    dropped = np.where(LOST, value, OUTPUT)
    with pytest.warns(LogWarning) as caught:
        identify_channels(channels_from([INPUT], [dropped], 0.1, ["u"], "y"), order=1, delay=1, n_numerator=1)
    assert any(f"for exactly {value:.4g} and returns" in str(one.message) for one in caught)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = identify_channels(
            channels_from([INPUT], [np.where(LOST, np.nan, OUTPUT)], 0.1, ["u"], "y"), order=1, delay=1, n_numerator=1
        )
    assert IdentificationCode.DROPS_OUT not in {note.code for note in found.notes}
    model = found.model.linear
    assert model is not None
    assert abs(model.dc_gain - 1.0) < 3.0 * model.dc_gain_std


@pytest.mark.parametrize(
    "y",
    [
        OUTPUT,
        np.round(OUTPUT),
        np.round(OUTPUT, 1),
        np.clip(OUTPUT, 4.5, 5.5),
        np.where(INPUT > 0.0, 1.0, 0.0),
        np.where(RNG.random(COUNT) < 0.3, 0.0, 5.0),
        np.where(np.arange(COUNT) % 200 == 7, 0.0, OUTPUT),
        np.full(COUNT, np.nan),
    ],
    ids=["sound", "coarse", "rounded", "limited", "two levels", "pulses", "seldom", "nothing"],
)
def test_other_outputs_do_not_drop_out(y: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> None:
    assert dropped_value(y) is None


def test_an_output_that_its_input_drops_is_not_accused() -> None:
    u = np.where(LOST, 0.0, OUTPUT)
    y = np.append(0.0, 2.0 * u[:-1])
    assert dropped_value(y) == 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        found = identify_channels(channels_from([u], [y], 0.1, ["u"], "y"), order=1, delay=1, n_numerator=1)
    assert IdentificationCode.DROPS_OUT not in {note.code for note in found.notes}
