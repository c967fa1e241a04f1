"""The published filter with equation 7.3 as printed, which divides friction by the volume too (errata E3, E8)."""

from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd

from estimation.eha.named_methods import NAMED
from estimation.filters.methods import METHODS
from estimation.filters.run import run_filter
from estimation.log_checks.first_belief import START_STD, first_belief
from estimation.models.eha_forms import BULK_MODULUS, PRINTED_FORM
from estimation.models.published_noise import PUBLISHED_TIME
from experiments.nine_conditions.bulk_modulus import PUBLISHED_METHOD
from experiments.nine_conditions.settings import StudySettings
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.model import EhaParameters

DURATION = 1.0
"""Duration of the log [s]; long enough to show whether the filter diverges."""


def printed_equations(rig: EhaParameters, settings: StudySettings) -> pd.DataFrame:
    """Filter the published experiment with equations 7.1 to 7.4 as printed, printed Q and R, from each first guess.

    Returns
    -------
    pandas.DataFrame
        Columns condition, start_pa, settled_pa (mean of the last 20 % of the log; NaN where the filter stopped being
        finite) and finite.
    """
    named = NAMED[PUBLISHED_METHOD.method]
    settings = replace(settings, sample_time=PUBLISHED_TIME, duration=DURATION)

    def settle(case: tuple[str, float]) -> dict[str, object]:
        name, start = case
        p = parameters_for(CONDITIONS[name], rig)
        rng = stream(settings.seed, "bulk modulus", PUBLISHED_METHOD.plant, PUBLISHED_METHOD.drive, name)
        record = PUBLISHED_METHOD.record(p, settings, rng)
        prior = first_belief(PRINTED_FORM, record, start, START_STD)
        found = run_filter(
            METHODS[named.method],
            PRINTED_FORM,
            prior,
            record,
            p,
            channels=tuple(named.variances),
            variances=named.variances,
            noise=named.noise,
        )
        settled = found.settled(BULK_MODULUS)[0]
        return {"condition": name, "start_pa": start, "settled_pa": settled, "finite": bool(np.isfinite(settled))}

    return pd.DataFrame(list(map_in_parallel(settle, product(CONDITIONS, settings.starts))))
