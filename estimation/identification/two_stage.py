"""Models between columns of logs, including closed loops by two stages (Van den Hof and Schrama 1993).

In a closed loop the input contains noise of the output, so a fit from input to output is biased. The part of the input
that the loop's reference explains contains none. The first stage finds this part, and the second relates it to the
output.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.from_records import channels_of
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.notes import IdentificationCode
from estimation.identification.state_space.identify import identify_outputs
from estimation.identification.two_stage_spread import Stage, with_first_stage
from plant.errors import HydrostateError, LogWarning
from plant.log.record import Record
from plant.notes import Note

LEAST_FOLLOWED = 5.0
"""Fit on blocks held back from which an input is held to follow a reference, a tenth of its power; judged [%]."""


def identify_columns(
    records: Sequence[Record],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    references: Sequence[str] = (),
    sample_time: float | None = None,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> tuple[list[Identified], list[Channels]]:
    """Identify one model for each output from columns of logs.

    Parameters
    ----------
    records : sequence of Record
        Logs, as experiments.
    inputs, outputs : sequence of str
        Columns.
    references : sequence of str
        Columns that drive the loop from outside, such as its set-point; none in open loop.
    sample_time : float, optional
        Of the model [s]; that of the logs unless told.
    options : Mapping[str, Any]
        As `identify_outputs` takes them.

    Returns
    -------
    tuple of list of Identified and list of Channels
        One an output, and the measured data.

    Raises
    ------
    HydrostateError
        If a column is not usable, or no reference drives an input.
    """
    data = [channels_of(records, inputs, output, sample_time, split=not references) for output in outputs]
    if not references:
        found = identify_outputs(data, **options)
        return found, [one.at_one_offset(each) for one, each in zip(found, data, strict=True)]
    if twice := set(references) & {*inputs, *outputs}:
        raise HydrostateError(f"a reference must be neither input nor output, got {min(twice)!r}")
    drives = [channels_of(records, references, one, data[0].sample_time) for one in inputs]
    return identify_by_reference(data, drives, **options), data


def identify_by_reference(data: Sequence[Channels], drives: Sequence[Channels], **options: Any) -> list[Identified]:
    """Identify outputs of a closed loop from the parts of its inputs that references explain.

    Parameters
    ----------
    data : sequence of Channels
        One an output, inputs alike.
    drives : sequence of Channels
        From the references to each input, sample by sample beside the data.
    **options
        As `identify_outputs` takes them.

    Returns
    -------
    list of Identified
        One an output. Fits are from the explained inputs: a run on measured ones would answer the noise twice.

    Raises
    ------
    HydrostateError
        If an input does not follow the references.
    """
    explained = [_explained_input(one) for one in drives]
    u = tuple(np.column_stack([runs[log] for runs, _, _ in explained]) for log in range(len(data[0].u)))
    driven = [replace(one, u=u) for one in data]
    found, stages = identify_outputs(driven, **options), [stage for _, _, stage in explained]
    found = [with_first_stage(one, one.at_one_offset(each), stages) for one, each in zip(found, driven, strict=True)]
    notes = tuple(note for _, note, _ in explained)
    return [replace(one, notes=(*one.notes, *notes)) for one in found]


def _explained_input(drive: Channels) -> tuple[list[Array], Note, Stage]:
    """Return the part of an input that references explain, for each log, a note of its share, and its model."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        stage = identify_channels(drive)
    named, share = ", ".join(drive.inputs), 1.0 - (1.0 - stage.quality.fit_percent / 100.0) ** 2
    if not stage.sound or not stage.held_back_percent > LEAST_FOLLOWED:
        raise HydrostateError(
            f"input {drive.output!r} does not follow the reference {named} (fit on blocks held back "
            f"{stage.held_back_percent:.1f} %): name a column that drives the loop, such as its set-point"
        )
    runs = [stage.model.simulate(r, u) for r, u in zip(drive.u, drive.y, strict=True)]
    note = IdentificationCode.TWO_STAGES.note(input=drive.output, reference=named, share=share)
    return runs, note, Stage(stage.model, drive)
