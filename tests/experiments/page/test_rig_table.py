"""The page of a log lists what the rig file says, so that a colleague sees what was assumed."""

import pytest

from experiments.page.numbers import MINUS, MISSING
from experiments.page.rig_table import rig_rows
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.piezo_stack.parameters import PiezoStackParameters


def test_entries_have_units_and_the_uncertain_ones_come_first() -> None:
    rig = Rig("P-12", EhaParameters(piston_area=3.04e-3), {"bulk_modulus": 0.3}, measured=("chamber_volume",))
    rows = rig_rows(rig)
    found = {row["entry"]: row for row in rows}
    assert found["piston_area"]["value"] == "0.00304 m²"
    assert found["chamber_volume"]["uncertainty"] == "± 5 %, measured"
    assert found["bulk_modulus"]["uncertainty"] == "± 30 %"
    assert found["moving_mass"]["uncertainty"] == f"{MINUS}10 % to +40 %"
    assert found["pressure_gain"]["value"] == "1"
    assert found["pilot_share"]["value"] == "0"  # without the unit 1
    assert found["stroke"]["value"] == MISSING
    assert found["friction_coulomb"] == {
        "entry": "friction_coulomb",
        "value": "436 N",
        "uncertainty": MISSING,
        "meaning": "Coulomb friction a_3",
    }
    told = [row["uncertainty"] == MISSING for row in rows]
    assert told == sorted(told)


@pytest.mark.parametrize("parameters", [EhaParameters(), PiezoStackParameters(), DiaphragmMotorParameters()])
def test_every_entry_of_every_kind_of_actuator_is_listed(parameters: object) -> None:
    names = [row["entry"] for row in rig_rows(Rig("a", parameters)) if row["entry"] != "pressure_gain"]
    assert sorted(names) == sorted(vars(parameters))
