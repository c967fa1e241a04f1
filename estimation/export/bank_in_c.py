"""A bank of interacting models in C: the loops of `estimation.filters.imm_loops`, translated for its sizes."""

from collections import Counter
from dataclasses import dataclass

from estimation.export.rule_in_c import RuleInC
from estimation.filters.imm_loops import STEP
from estimation.models.model import ProcessModel
from plant.compiled.c99.loops import ExternalFunction, Translation
from plant.compiled.c99.precision import Precision
from plant.compiled.c99.shapes import Block, Scalar, Thing


@dataclass(frozen=True)
class BankInC:
    """A bank in C.

    Parameters
    ----------
    text : str
        Definitions of ``PREFIX_step_bank``, ``PREFIX_combine`` and what they call.
    operations : Counter
        Largest number of operations in a step [operations].
    """

    text: str
    operations: Counter[str]


def bank_in_c(
    rule: RuleInC,
    model: ProcessModel,
    channels: int,
    modes: int,
    substeps: int,
    precision: Precision,
    prefix: str,
) -> BankInC:
    """Write the step of a bank, and the function that combines its modes, in C.

    Parameters
    ----------
    rule : RuleInC
        The filter that each mode runs.
    channels, modes, substeps : int
        Numbers of measured channels, of modes, and of the model's steps for each sample.
    prefix : str
        Prefix of the functions' names.
    """
    belief = model.width + model.width * (model.width + 1) // 2
    outside = {
        "predict": ExternalFunction(
            f"{prefix}_predict_mode", (False, True, False, False, False, False), rule.operations["predict"]
        ),
        "update": ExternalFunction(
            f"{prefix}_update_mode", (False, True, False, False, True), rule.operations["update"]
        ),
    }
    constants = {"WIDTH": model.width, "BELIEF": belief}
    translation = Translation({one.__name__: one for one in STEP}, constants, outside, precision, prefix)

    def block(name: str, *shape: int) -> Block:
        return Block(name, shape, name)

    states, each = block("states", modes, len(rule.carried)), block("each", modes)
    room = block("mixed", modes, len(rule.carried)), each, each, block("shift", belief)
    drives, sample = block("drives", len(model.drives)), block("sample", channels)
    given: list[Thing] = [
        Scalar("begun", True),
        states,
        block("constants", modes, max(1, rule.constants)),
        Block("kinds", (modes,), "kinds", whole=True),
        (block("transitions", modes, modes), each),
        drives,
        drives,
        sample,
        Scalar(str(substeps), True),
        (each, block("seen", modes, 2, channels), each, each, each, room),
        (sample, sample, block("innovations", 2, channels)),
    ]
    step = translation.translate("step_bank", given, {"substeps": substeps})
    translation.translate(
        "combine", [Scalar("density"), states, each, block("shift", belief), block("overall", belief)]
    )
    return BankInC(translation.text, step.operations)
