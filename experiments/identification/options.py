"""Options of `hydrostate identify`, one for each line of its help."""

from pathlib import Path
from typing import Annotated

from experiments.command.options import option
from experiments.identification.of_channels import STRUCTURES

ONLY_BETWEEN_COLUMNS = ("narx", "hammerstein", "wiener", "state-space")
"""Structures that can only be fitted between columns."""

StructureName = Annotated[
    str,
    option(
        "NAME",
        f"{', '.join([*STRUCTURES, *ONLY_BETWEEN_COLUMNS])}; auto takes the best on held-back data. "
        "With --input and --output also: narx (polynomial), hammerstein (dead zone, saturation or backlash before "
        "a linear model), wiener (a linear model whose output is measured without its sign), state-space (one model "
        "of all outputs; its order is the number of states).",
    ),
]

Order = Annotated[
    str | None,
    option(
        "INT|auto",
        "Order of the denominator; auto takes the best by BIC, or with --input and --output the best free run on "
        "held-back blocks.",
        show_default="2; auto with --input",
    ),
]

Numerator = Annotated[
    int | None, option("INT", "Number of numerator coefficients; by default one more than the order.", min=1)
]

Delay = Annotated[
    str | None, option("INT|auto", "Dead time [samples of the model].", show_default="0; auto with --input")
]

SampleTime = Annotated[
    float | None,
    option(
        "S",
        "Sample time of the model [s], and of a log without a time column; by default 1e-3 (Table 6), or the log's "
        "if that is longer. It replaces a clock that stands still or goes back. With --input, only of logs without a "
        "time column.",
    ),
]

Resample = Annotated[float | None, option("S", "With --input: sample time of the model [s]; by default the log's.")]

FilterHz = Annotated[
    float | None,
    option("HZ", "Cut-off of a zero-phase low-pass on input and output before the fit [Hz]; none by default."),
]

Inputs = Annotated[
    list[str] | None,
    option(
        "COLUMN",
        "Input: any column in any unit; repeat the option, or separate several by commas.",
        "--input",
        show_default="motor_speed_rad_s",
    ),
]

Outputs = Annotated[
    list[str] | None,
    option("COLUMN", "Output, likewise; one model per output.", "--output", show_default="velocity_m_s"),
]

References = Annotated[
    list[str] | None,
    option("COLUMN", "With --input, of a closed loop: what drives it, such as its set-point.", "--reference"),
]

Validate = Annotated[
    list[Path] | None, option("LOG", "With --input: a log to test the model on; it is not used for the fit.")
]

Simulate = Annotated[
    Path | None,
    option("MODEL", "Simulate this saved model (a file from --out) on the logs instead of fitting one."),
]

Simulated = Annotated[
    Path | None, option("CSV", "With --input or --simulate: write time, inputs, measured and simulated output.")
]

Figure = Annotated[
    Path | None, option("PNG", "Draw measured and simulated output, the residual, its correlations, and the gain.")
]

Response = Annotated[
    Path | None,
    option(
        "PNG",
        "With --input: draw the frequency response; --json also prints it, with the distortion levels of a multisine.",
    ),
]
