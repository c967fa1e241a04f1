"""A pump of 11 cm3 per turn in stiff oil under a binary drive: effects that are small in soft oil matter here."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.hypothesis_search.form_fit import FormFit
from experiments.open_benchmark.draws import course_of, draw_plain
from experiments.open_benchmark.run import run
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.thinned import thinned

LARGE = replace(
    EhaParameters(),
    pump_displacement=1.751e-6,
    piston_area=3.436e-3,
    chamber_volume=0.95e-3,
    moving_mass=30.0,
    bulk_modulus=9e8,
    leakage_coefficient=6e-12,
    flow_bias=3e-6,
    friction_quadratic=4e4,
    friction_linear=3000.0,
    friction_coulomb=900.0,
    relief_pressure=7e6,
    accumulator_pressure=3e5,
)
RIG = replace(LARGE, bulk_modulus=EhaParameters().bulk_modulus)


def fitted(condition: str, seed: int) -> tuple[FormFit, float]:
    drawing, driving, logging = np.random.default_rng(seed).spawn(3)
    setup = replace(draw_plain(condition, "prbs", drawing, LARGE), rated_speed=157.08, duration=5.0, travel=0.2)
    setup = setup.with_machine(stroke=0.6, ripple=0.0)
    log = setup.logger.log(run(setup.machine, course_of(setup, driving)), logging)
    return fit_flow(Record.from_frame(log), RIG, 3e8), setup.machine.bulk_modulus


@pytest.mark.parametrize(
    ("condition", "seed"), thinned([("normal", 5063), ("major_friction", 5055)], [("normal", 5063)])
)
def test_bulk_modulus_is_within_its_interval(condition: str, seed: int) -> None:
    fit, true = fitted(condition, seed)
    value, std = fit.parameters["bulk_modulus"]
    assert fit.reasons == ()
    assert fit.explanation is None
    assert abs(value - true) < 2.5 * std
    assert std < 3e-3 * true
