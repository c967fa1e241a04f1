"""Sentences of the library's report: why output error, which order, and the cost of the test's clock."""

import pandas as pd

from experiments.library.structures import EARLIER_ORDER, MADE_FOR, PAPER_BANDWIDTH, PAPER_ORDER


def structure_sentences(found: pd.DataFrame) -> tuple[str, str, str]:
    """Say which structure is most accurate, and why.

    Parameters
    ----------
    found : pandas.DataFrame
        As `structure_table` returns it.

    Returns
    -------
    tuple of str
        Who is ahead and by how much; what one-step fits say; where the criteria look.
    """
    of = {str(name): rows.set_index("condition") for name, rows in found.groupby("structure", sort=False)}
    ours, others = of["output-error"], (of["ARMAX"], of["Box-Jenkins"])
    behind = {name: rows["behind_percent"] for name, rows in of.items()}
    median = max(rows["behind_percent"].median() for rows in others)
    most = max(rows["behind_percent"].max() for rows in others)
    ahead = sum(int((rows["one_step_percent"] > ours["one_step_percent"]).sum()) for rows in others)
    weight = {name: rows["weight_above_percent"].mean() for name, rows in of.items()}
    rivals = ", ".join(f"{weight[name]:.0f} % of that of {name}" for name in of if name != "output-error")
    gain = 100.0 * (of["ARX"]["dc_gain"] / ours["dc_gain"]).min()
    return (
        f"Running free, output error is best in {int(ours['best'].sum())} of {len(ours)} conditions and never more "
        f"than {behind['output-error'].max():.2g} percentage points behind the best. ARX is {behind['ARX'].min():.2g} "
        f"to {behind['ARX'].max():.2g} points behind; ARMAX and Box-Jenkins are {median:.2g} behind in the median "
        f"condition and {most:.2g} at most.",
        f"One step ahead it is the other way round: these two predict the next sample better than output error in "
        f"{ahead} of {2 * len(ours)} cases, because they lean on the last samples measured. A library is run on a log "
        "to see which condition explains it, and has no measured output to lean on.",
        "Why: output error minimises the error of just that free run. The others minimise the error one step ahead, in "
        "which an error of the transfer function counts by the input's power over that of the noise model. What a "
        "linear model leaves of a rubbing piston is slow, so the weight moves to high frequencies: above "
        f"{PAPER_BANDWIDTH:g} Hz lie {weight['output-error']:.0f} % of output error's criterion, which is the drive's "
        f"share of power there, and {rivals}, on average. Where the plant is nearly linear all weights lead to nearly "
        "one model; where friction dominates they do not. ARX cannot choose its weight: its noise must pass through "
        f"the plant's poles. The sensor's does not, and the fitted gain falls to {gain:.0f} % of output error's "
        "at worst.",
    )


def order_sentences(found: pd.DataFrame) -> tuple[str, str]:
    """Say what the data hold of the order and the break frequency, beside the paper.

    Parameters
    ----------
    found : pandas.DataFrame
        As `order_and_bandwidth` returns it.

    Returns
    -------
    tuple of str
        On the order, and on the bandwidth.
    """
    by_values, by_bic, kept = (_either(found[f"order_{how}"]) for how in ("by_values", "by_bic", "of_library"))
    second, gained = found["value_2_over_floor"], found["fit_2_percent"] - found["fit_1_percent"]
    rubbing = found["condition"].str.contains("friction")
    free, stiff = found["bandwidth_hz"][~rubbing], found["bandwidth_hz"][rubbing]
    return (
        f"The paper finds order {PAPER_ORDER}, the authors' earlier work order {EARLIER_ORDER}. Here the singular "
        f"values that stand above their noise floor say order {by_values}; the second value reaches {second.min():.2g} "
        f"to {second.max():.2g} of the floor. BIC asks for {by_bic}, but a second pole is worth {gained.min():.2g} to "
        f"{gained.max():.2g} percentage points of fit: what is missing is not a pole but friction and the relief "
        "valve, which no linear order describes, and with enough samples BIC buys poles for them. Around a mean "
        f"the library keeps what BIC prefers among orders 1 and 2 whose poles and gain the data determine, order "
        f"{kept}.",
        f"The gain is 3 dB down at {free.min():.1f} to {free.max():.1f} Hz without added friction and at "
        f"{stiff.min():.1f} to {stiff.max():.1f} Hz with it. The paper's {PAPER_BANDWIDTH:g} Hz are judged from its "
        "Figures 5 and 6 (errata E14).",
    )


def clock_sentences(found: pd.DataFrame) -> tuple[str]:
    """Say what a literal 5 Hz clock costs at 25 Hz.

    Parameters
    ----------
    found : pandas.DataFrame
        As `clock_table` returns it, indexed or not.
    """
    at, steady = (found.set_index("input")[name] for name in ("at_25_hz", "steady_state"))
    return (
        f"A clock of 200 ms, 5 Hz read literally, leaves the gain at 25 Hz {at['200 ms'] / at['10 ms']:.1f} times less "
        f"certain than one of 10 ms and {at['200 ms'] / at['20 ms']:.1f} times less than one of 20 ms; the steady gain "
        f"becomes {steady['10 ms'] / steady['200 ms']:.1f} times more certain than at 10 ms. A maximum-length sequence "
        f"made for 25 Hz comes within {100.0 * (at[MADE_FOR] / at.min() - 1.0):.0f} % of the best test there.",
    )


def _either(orders: pd.Series) -> str:
    return " or ".join(str(order) for order in sorted({int(order) for order in orders}))
