"""Physics, parameters, signals, sensors, and `Record`: a run or a log.

The names that a user needs, each with an example; everything else is found by the names of the files.

```text
CircuitParameters         CircuitParameters(motor_lag=5e-3)
Code                      class LeakCode(Code): ...
DiaphragmMotorParameters  DiaphragmMotorParameters(load_force=10.0)
DRIVES                    list(DRIVES)
EhaParameters             EhaParameters(bulk_modulus=1.5e9)
HydrostateError           except HydrostateError as error: print(error)
LogError                  except LogError as error: print(error.source)
make_drive                make_drive("steps", 10.0, 1e-3, EhaParameters(), rng)
measure                   measure(record, SENSORS["bench"], rng)
Note                      str(note)
notes                     notes(EhaParameters)["piston_area"].unit
PiezoStackParameters      PiezoStackParameters(load_mass=20.0)
PLANTS                    PLANTS["lumped"]
read_record               read_record("run.csv")
read_rig                  read_rig("rig.toml")
Record                    Record(1e-3, {"motor_speed_rad_s": speed, "position_m": position})
Rig                       Rig("bench 2", EhaParameters(piston_area=3.04e-3))
Sensors                   replace(SENSORS["bench"], position_quantum=1e-6)
SENSORS                   SENSORS["bench"]
SI                        SI("m^2", "effective piston area", "Table 2")
simulate                  simulate(PLANTS["circuit"], speed, 1e-3, EhaParameters())
write_record              write_record(record, "run.parquet")
```
"""

from typing import TYPE_CHECKING

from plant.lazy import lazy_getattr

if TYPE_CHECKING:
    from plant.diaphragm_motor.parameters import DiaphragmMotorParameters as DiaphragmMotorParameters
    from plant.eha.circuit_parameters import CircuitParameters as CircuitParameters
    from plant.eha.drives import DRIVES as DRIVES
    from plant.eha.drives import make_drive as make_drive
    from plant.eha.model import EhaParameters as EhaParameters
    from plant.eha.rig import Rig as Rig
    from plant.eha.rig import read_rig as read_rig
    from plant.eha.simulate import PLANTS as PLANTS
    from plant.eha.simulate import simulate as simulate
    from plant.errors import HydrostateError as HydrostateError
    from plant.errors import LogError as LogError
    from plant.log.files import read_record as read_record
    from plant.log.files import write_record as write_record
    from plant.log.record import Record as Record
    from plant.notes import Code as Code
    from plant.notes import Note as Note
    from plant.piezo_stack.parameters import PiezoStackParameters as PiezoStackParameters
    from plant.sensors.sensors import SENSORS as SENSORS
    from plant.sensors.sensors import Sensors as Sensors
    from plant.sensors.sensors import measure as measure
    from plant.units import SI as SI
    from plant.units import notes as notes

__getattr__ = lazy_getattr(__name__, __file__)
