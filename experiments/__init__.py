"""Studies, batches, figures, reports, and the command line.

The names that a user needs, each with an example; everything else is found by the names of the files.

```text
actuator      actuator("piezo-stack").description
ActuatorKind  ActuatorKind(name="tank", description="a tank", ...)
ACTUATORS     list(ACTUATORS)
Answer        answer.to_frame()
load          load("rmse")
Log           Log(record, Rig()).estimate()
main          main()
```
"""

from typing import TYPE_CHECKING

from plant.lazy import lazy_getattr

if TYPE_CHECKING:
    from experiments.actuator_kind import ActuatorKind as ActuatorKind
    from experiments.actuators import ACTUATORS as ACTUATORS
    from experiments.actuators import actuator as actuator
    from experiments.cli import main as main
    from experiments.published import load as load
    from experiments.python_user.answers import Answer as Answer
    from experiments.python_user.log import Log as Log

__getattr__ = lazy_getattr(__name__, __file__)
