"""The nine conditions, injection of faults, banks of models, classification, severity, detection.

The names that a user needs, each with an example; everything else is found by the names of the files.

```text
Condition           CONDITIONS["normal"].leakage
CONDITIONS          CONDITIONS["minor_leakage"]
diagnose_clean      diagnose_clean(clean_log(record, parameters), actuator_of(parameters))
diagnose_log        diagnose_log(record, Rig()).condition
diagnose_motor      diagnose_motor(record, DiaphragmMotorParameters())
diagnose_stack      diagnose_stack(record, PiezoStackParameters())
find_condition      find_condition("major_friction")
mathematical_bank   mathematical_bank(EhaParameters())
MOTOR_FAULTS        list(MOTOR_FAULTS)
parameters_for      parameters_for(CONDITIONS["minor_leakage"], EhaParameters())
score_mathematical  score_mathematical(record, mathematical_bank(EhaParameters()))
severity            severity(1.5, 0.0, EhaParameters())
STACK_FAULTS        list(STACK_FAULTS)
watch_record        watch_record(record, EhaParameters())
```
"""

from typing import TYPE_CHECKING

from plant.lazy import lazy_getattr

if TYPE_CHECKING:
    from faults.conditions import CONDITIONS as CONDITIONS
    from faults.conditions import Condition as Condition
    from faults.conditions import find_condition as find_condition
    from faults.conditions import parameters_for as parameters_for
    from faults.conditions import severity as severity
    from faults.diagnosis.by_circuits import diagnose_clean as diagnose_clean
    from faults.diagnosis.diagnose import diagnose_log as diagnose_log
    from faults.diagnosis.rmse import score_mathematical as score_mathematical
    from faults.diaphragm_motor.diagnose import diagnose_motor as diagnose_motor
    from faults.diaphragm_motor.faults import MOTOR_FAULTS as MOTOR_FAULTS
    from faults.eha.bank import mathematical_bank as mathematical_bank
    from faults.piezo_stack.diagnose import diagnose_stack as diagnose_stack
    from faults.piezo_stack.faults import STACK_FAULTS as STACK_FAULTS
    from faults.watch.watch import watch_record as watch_record

__getattr__ = lazy_getattr(__name__, __file__)
