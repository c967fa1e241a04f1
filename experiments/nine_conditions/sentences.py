"""The study's outcome in three sentences."""

from collections.abc import Mapping

from experiments.nine_conditions.bulk_modulus import (
    POSITION_SINE,
    POSITION_STEPS,
    PRESSURE_SINE,
    PRESSURE_STEPS,
    PUBLISHED_METHOD_STICKING,
    Experiment,
)
from experiments.nine_conditions.findings import ClassAccuracy, Recovery, class_accuracies, recoveries, truth_of
from experiments.nine_conditions.validation import BANKS, TRANSFER_FUNCTIONS, WITH_PRESSURE, WITHOUT_PRESSURE
from experiments.page.frames import Tables


def verdict(tables: Tables) -> tuple[str, str, str]:
    """Summarise the findings of a study in three sentences.

    Returns
    -------
    tuple of str
        On the bulk modulus, on the fault classes, and on what cannot be observed.
    """
    found = recoveries(tables["bulk_modulus"])
    return (
        _bulk_modulus_sentence(found, truth_of(tables)),
        _class_sentence(class_accuracies(tables)),
        _limit_sentence(found[POSITION_SINE], found[PUBLISHED_METHOD_STICKING]),
    )


def _bulk_modulus_sentence(found: Mapping[Experiment, Recovery], truth: float) -> str:
    sine, steps, alone = found[PRESSURE_SINE], found[PRESSURE_STEPS], found[POSITION_STEPS]
    if sine.mean_pa is None or steps.mean_pa is None:
        return "With differential pressure logged, no bulk modulus was recovered: see the table of estimates."
    mean = (sine.mean_pa + steps.mean_pa) / 2.0
    worst = max(sine.worst_error_percent or 0.0, steps.worst_error_percent or 0.0)
    conditions = min(sine.recovered, steps.recovered)
    second = (
        ""
        if alone.worst_error_percent is None
        else f" Without pressure, the error on the nine steps is at most {alone.worst_error_percent:.2g} %."
    )
    return (
        f"With differential pressure logged, bulk modulus is found in {conditions} of {sine.conditions} conditions "
        f"from every first guess: {mean / 1e6:.1f} MPa on average, where {truth / 1e6:.1f} MPa is right. The worst of "
        f"{sine.estimates + steps.estimates} estimates is {worst:.2g} % off.{second}"
    )


def _class_sentence(classes: tuple[ClassAccuracy, ...]) -> str:
    percent = {bank: tuple(f"{entry.percent:.3g} %" for entry in classes if entry.bank == bank) for bank in BANKS}
    nominal, spread = percent[WITH_PRESSURE]
    return (
        f"With pressure logged, mathematical models name the right condition in {nominal} of {classes[0].runs} runs, "
        f"and in {spread} if leakage, friction and oil differ at random from the models. Without pressure these shares "
        f"are {' and '.join(percent[WITHOUT_PRESSURE])}; transfer functions reach "
        f"{' and '.join(percent[TRANSFER_FUNCTIONS])}."
    )


def _limit_sentence(stuck: Recovery, published: Recovery) -> str:
    return (
        f"A 10 Hz sine without a pressure sensor does not show bulk modulus in {len(stuck.unobservable)} of "
        f"{stuck.conditions} conditions, because friction holds the piston. There the published filter finds it in "
        f"{published.recovered} of {published.conditions}. Log differential pressure, or drive with larger, slower "
        "steps."
    )
