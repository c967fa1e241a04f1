"""Models, filters, smoothers, fits, identification, and the tests that say whether to believe them.

The names that a user needs, each with an example; everything else is found by the names of the files.

```text
bulk_modulus_bound     bulk_modulus_bound(FORMS["pressure"], prior, record, EhaParameters())
clean_log              clean_log(record, EhaParameters()).left_out
consistency_gate       consistency_gate(estimate, "bulk_modulus_pa", record)
Estimate               estimate.settled("bulk_modulus_pa")
estimate_log           estimate_log(record, Rig())
estimate_motor         estimate_motor(record, DiaphragmMotorParameters())
estimate_stack         estimate_stack(record, PiezoStackParameters())
EstimateOptions        estimate_log(record, Rig(), EstimateOptions(method="ekf"))
Finding                finding.gate.passed
FORMS                  FORMS["pressure"]
Gaussian               Gaussian(mean, covariance)
GreyBoxModel           GreyBoxModel("tank", ...)
identify_record        identify_record(record)
LinearModel            model.to_control()
measurement_variances  measurement_variances(record, ["position_m"])
METHODS                METHODS["ekf"]
nees                   nees(errors, covariances).mean()
Outcome                finding.outcome is Outcome.OK
ProcessModel           ProcessModel("tank", states, step, observe)
Quantity               finding.quantities["bulk_modulus"].ci95
run_filter             run_filter(METHODS["ekf"], FORMS["pressure"], prior, record, EhaParameters())
```
"""

from typing import TYPE_CHECKING

from plant.lazy import lazy_getattr

if TYPE_CHECKING:
    from estimation.diaphragm_motor.estimate import estimate_motor as estimate_motor
    from estimation.eha.bulk_modulus import EstimateOptions as EstimateOptions
    from estimation.eha.estimate import estimate_log as estimate_log
    from estimation.filters.methods import METHODS as METHODS
    from estimation.filters.run import Estimate as Estimate
    from estimation.filters.run import run_filter as run_filter
    from estimation.finding import Finding as Finding
    from estimation.finding import Outcome as Outcome
    from estimation.finding import Quantity as Quantity
    from estimation.identification.from_record import identify_record as identify_record
    from estimation.identification.model.linear_model import LinearModel as LinearModel
    from estimation.log_checks.clean import clean_log as clean_log
    from estimation.log_checks.measurement_noise import measurement_variances as measurement_variances
    from estimation.models.eha_forms import FORMS as FORMS
    from estimation.models.gaussian import Gaussian as Gaussian
    from estimation.models.greybox import GreyBoxModel as GreyBoxModel
    from estimation.models.model import ProcessModel as ProcessModel
    from estimation.piezo_stack.estimate import estimate_stack as estimate_stack
    from estimation.trust.bounds import bulk_modulus_bound as bulk_modulus_bound
    from estimation.trust.consistency import consistency_gate as consistency_gate
    from estimation.trust.consistency import nees as nees

__getattr__ = lazy_getattr(__name__, __file__)
