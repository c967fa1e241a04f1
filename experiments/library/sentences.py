"""Sentences of the library's report: why output error, which order, and the cost of the test's clock."""

import pandas as pd

from experiments.library.structures import EARLIER_ORDER, MADE_FOR, PAPER_BANDWIDTH, PAPER_ORDER


def structure_sentences(found: pd.DataFrame) -> tuple[str, str, str]:
    """Report which structure is most accurate, and why.

    Parameters
    ----------
    found : pandas.DataFrame
        Table from `structure_table`.

    Returns
    -------
    tuple of str
        The best structure and its lead; the result of one-step fits; the frequencies that the criteria weigh.
    """
    of = {str(name): rows.set_index("condition") for name, rows in found.groupby("structure", sort=False)}
    ours, others = of["output-error"], (of["ARMAX"], of["Box-Jenkins"])
    behind = {name: rows["behind_percent"] for name, rows in of.items()}
    median = max(rows["behind_percent"].median() for rows in others)
    most = max(rows["behind_percent"].max() for rows in others)
    ahead = sum(int((rows["one_step_percent"] > ours["one_step_percent"]).sum()) for rows in others)
    weight = {name: rows["weight_above_percent"].mean() for name, rows in of.items()}
    rivals = ", ".join(f"{name} has {weight[name]:.0f} %" for name in of if name != "output-error")
    gain = 100.0 * (of["ARX"]["dc_gain"] / ours["dc_gain"]).min()
    return (
        f"Running free, output error is best in {int(ours['best'].sum())} of {len(ours)} conditions and never more "
        f"than {behind['output-error'].max():.2g} percentage points behind the best. ARX is {behind['ARX'].min():.2g} "
        f"to {behind['ARX'].max():.2g} points behind; ARMAX and Box-Jenkins are {median:.2g} points behind in the "
        f"median condition and {most:.2g} points at most.",
        f"One step ahead, ARMAX and Box-Jenkins predict better than output error in {ahead} of {2 * len(ours)} cases, "
        "because they use the last measured samples. A library runs free on a log, so it has no measured output "
        "to use.",
        "Why: output error minimises the error of the free run. The others minimise the error one step ahead, which "
        "weighs each frequency by the input's power over that of the noise model. Friction leaves a slow residual, "
        f"which the noise model takes up, so the weight moves to high frequencies. Above {PAPER_BANDWIDTH:g} Hz, "
        f"output error has {weight['output-error']:.0f} % of its weight on average, the share that the drive has of "
        f"its power there; {rivals}. "
        "The weights hardly matter for a nearly linear plant, but they matter much under friction. ARX assumes that "
        "noise passes through the plant's poles, but sensor noise does not: the fitted gain falls to as little as "
        f"{gain:.0f} % of output error's.",
    )


def order_sentences(found: pd.DataFrame) -> tuple[str, str]:
    """Report what the data show about the order and the break frequency, compared with the paper.

    Parameters
    ----------
    found : pandas.DataFrame
        Table from `order_and_bandwidth`.

    Returns
    -------
    tuple of str
        One sentence on the order, one on the bandwidth.
    """
    by_values, by_bic, kept = (_orders_text(found[f"order_{how}"]) for how in ("by_values", "by_bic", "of_library"))
    second, gained = found["value_2_over_floor"], found["fit_2_percent"] - found["fit_1_percent"]
    rubbing = found["condition"].str.contains("friction")
    free, stiff = found["bandwidth_hz"][~rubbing], found["bandwidth_hz"][rubbing]
    return (
        f"The paper finds order {PAPER_ORDER}, the authors' earlier work order {EARLIER_ORDER}. Here the singular "
        f"values that stand above their noise floor say order {by_values}; the second value reaches {second.min():.2g} "
        f"to {second.max():.2g} of the floor. BIC asks for {by_bic}, but a second pole is worth {gained.min():.2g} to "
        f"{gained.max():.2g} percentage points of fit: BIC adds poles for friction and the relief valve, which "
        "no linear order describes. Of orders 1 and 2, the library keeps the one that BIC prefers among those whose "
        f"poles and gain the data determine: order {kept}.",
        f"The gain is 3 dB down at {free.min():.1f} to {free.max():.1f} Hz without added friction and at "
        f"{stiff.min():.1f} to {stiff.max():.1f} Hz with it. The paper's {PAPER_BANDWIDTH:g} Hz are judged from its "
        "Figures 5 and 6 (errata E14).",
    )


def clock_sentences(found: pd.DataFrame) -> tuple[str]:
    """Report the loss of accuracy at 25 Hz from a literal 5 Hz clock.

    Parameters
    ----------
    found : pandas.DataFrame
        Table from `clock_table`, indexed or not.
    """
    at, steady = (found.set_index("input")[name] for name in ("at_25_hz", "steady_state"))
    return (
        f"The paper's 5 Hz clock, read literally, holds each level for 200 ms. At 25 Hz, the gain is then "
        f"{at['200 ms'] / at['10 ms']:.1f} times as uncertain as with 10 ms, and {at['200 ms'] / at['20 ms']:.1f} "
        f"times as uncertain as with 20 ms; the steady gain is {steady['10 ms'] / steady['200 ms']:.1f} times less "
        "uncertain than with 10 ms. With a maximum-length sequence made for 25 Hz, the deviation at 25 Hz is "
        f"{100.0 * (at[MADE_FOR] / at.min() - 1.0):.0f} % above that of the best test.",
    )


def _orders_text(orders: pd.Series) -> str:
    return " or ".join(str(order) for order in sorted({int(order) for order in orders}))
