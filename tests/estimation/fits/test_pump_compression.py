"""A pump that is filled at its inlet delivers less at its outlet: bulk modulus is right, and the effect is named."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.log_checks.clean import clean_log
from estimation.models.wide_flow import compressed_delivery
from estimation.notes import RigCode
from experiments.open_benchmark.draws import course_of, draw_plain
from experiments.open_benchmark.run import run
from plant.eha.model import EhaParameters
from plant.log.record import Record

RIG = EhaParameters()
SHARE = 3.0
"""Oil that the pump compresses over the oil that it delivers: twice the delivered oil stays in its teeth."""


def filled_at_its_inlet() -> tuple[Record, float]:
    """Return six seconds of an actuator with other equations, and its bulk modulus [Pa].

    The pump of those equations delivers its displacement at the outlet. A pump that is filled at the inlet turns faster
    for the same flow, by the oil's compression.
    """
    drawing, driving, logging = np.random.default_rng(5).spawn(3)
    drawn = draw_plain("major_friction", "steps", drawing).with_machine(bulk_modulus=6e7)
    setup = replace(drawn, duration=6.0)
    log = Record.from_frame(setup.logger.log(run(setup.machine, course_of(setup, driving)), logging))
    speed, beta = log["motor_speed_rad_s"], setup.machine.bulk_modulus
    squeezed = np.sign(speed) * log["differential_pressure_pa"] / beta
    return log.replace(motor_speed_rad_s=speed / (1.0 - SHARE * squeezed)), beta


def test_a_pump_that_compresses_its_oil_is_identified_and_bulk_modulus_is_right() -> None:
    record, modulus = filled_at_its_inlet()
    log = clean_log(record, RIG)
    fit = fit_flow(log.record, RIG, RIG.bulk_modulus, {}, log.variances)
    found = fit.explanation
    assert found is not None
    assert not fit.reasons
    (value, std), (share, share_std) = fit.parameters["bulk_modulus"], found.values["pump_compression"]
    assert abs(value - modulus) < 3.0 * std
    assert std < 0.01 * modulus
    assert abs(share - SHARE) < max(3.0 * share_std, 0.1)
    (note,) = (note for note in notes_of(found, RIG) if note.code is RigCode.PUMP_COMPRESSES)
    assert note.data["share"] == pytest.approx(share)


def test_a_pump_loses_the_compression_of_its_oil_and_of_the_oil_left_in_its_teeth() -> None:
    assert compressed_delivery(0.02, 1.0) == pytest.approx(0.98)
    assert compressed_delivery(0.02, 1.5) == pytest.approx(0.97)
    assert compressed_delivery(-0.02, 1.0) == pytest.approx(1.02)
    assert compressed_delivery(0.02, 0.0) == 1.0
