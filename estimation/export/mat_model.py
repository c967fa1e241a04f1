"""An identified linear model as a MAT file."""

from io import BytesIO
from typing import Any, cast

import numpy as np

from estimation.export.c_model import require_transfer_function
from estimation.identification.free_run.model import FreeRunModel
from plant.compiled.c99.files import checked_name


def model_in_mat(model: FreeRunModel, *, name: str) -> dict[str, bytes]:
    """Return the MAT file of a linear model, whose variables are those of a transfer function of MATLAB.

    ``numerator`` and ``denominator`` are in powers of the delay operator, one row for each input. The output is that of
    the transfer functions driven by the inputs minus ``input_mean``, plus ``output_level``.

    Raises
    ------
    HydrostateError
        If the model is not linear or has limits, or the name is no name.
    """
    from scipy.io import savemat

    require_transfer_function(model)
    numerators, denominators = model.padded_transfer_functions()
    held = BytesIO()
    savemat(
        cast(Any, held),
        {
            "numerator": np.array(numerators),
            "denominator": np.array(denominators),
            "sample_time_s": model.sample_time,
            "inputs": np.array(model.inputs, dtype=object),
            "output": model.output,
            "input_mean": model.scaling.u_mean,
            "output_level": model.level,
        },
    )
    return {f"{checked_name(name)}.mat": held.getvalue()}
