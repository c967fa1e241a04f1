"""Classification by smallest RMSE over seeds and conditions, and Table 5, each against its tolerance."""

import argparse

from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.transfer_functions import identification_study
from experiments.nine_conditions.validation import classification_study, validation_study
from experiments.page.frames import cell
from plant.eha.model import EhaParameters

WANTED = {
    ("mathematical, pressure logged", "nominal"): 1.0,
    ("mathematical", "nominal"): 1.0,
    ("mathematical, pressure logged", "spread"): 0.95,
    ("mathematical", "spread"): 0.95,
}
"""Minimum accuracy of the mathematical bank; the transfer functions' figures are printed without a target."""


def main(arguments: list[str]) -> int:
    """Print accuracies and Table 5; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=2024)
    options = parser.parse_args(arguments)
    settings = StudySettings(seed=options.seed, seeds=options.seeds)
    rig = EhaParameters()
    library, _ = identification_study(rig, settings)
    summary = classification_study(rig, library, settings)["classification"]
    print(summary.to_string(index=False))
    rmse, _ = validation_study(rig, library, settings)
    print(rmse.to_string(index=False))
    better = int(rmse["mathematical_is_better"].sum())
    print(f"\nmathematical model better in {better} of 9 conditions (8 wanted)")
    short = [
        key for key, wanted in WANTED.items() if cell(summary.set_index(["bank", "variant"]), key, "accuracy") < wanted
    ]
    print(f"banks below what is wanted: {short or 'none'}")
    return len(short) + (better < 8)
