"""The report of the nine-condition library: its models, why they are output error, their order, and the test."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from experiments.figures.library import LIBRARY_FIGURES
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Cell, Column, fixed, html_table, number
from experiments.report.words import in_words
from experiments.studies.identification_structures import EARLIER_ORDER, MADE_FOR, PAPER_BANDWIDTH, PAPER_ORDER

Tables = Mapping[str, pd.DataFrame]

INTRODUCTION = (
    "Nine transfer functions from motor speed [rad/s] to piston velocity [m/s], identified by output error on the "
    "circuit plant, which no fit here assumes. The motor turns around a mean, so that the piston does not turn round "
    "within a pass. library.json beside this page holds them at full precision, with both covariances."
)

CONDITION = Column("condition", "condition", words=lambda name: Cell(in_words(name), "name"))
MILLI = 1e3
SOURCES = ("library", "Table 6")


def render_library_report(tables: Tables, figures: Mapping[str, bytes], seed: int) -> str:
    """Return the library's report as one HTML page with its figures inside.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What `hydrostate library` found.
    figures : Mapping[str, bytes]
        SVG files, by the names of `LIBRARY_FIGURES`.
    seed : int
        Seed of the run.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    words: Mapping[str, Sequence[str]] = {
        "structures": structure_sentences(tables["structures"]),
        "orders": order_sentences(tables["orders"]),
        "clocks": clock_sentences(tables["clocks"]),
    }
    shown: Mapping[str, Sequence[Markup]] = {
        "library": (_models(tables["library"]), _roots(tables["roots"])),
        "structures": (_structures(tables["structures"]),),
        "orders": (_orders(tables["orders"]),),
        "clocks": (_clocks(tables["clocks"]),),
    }
    sections = [
        Section(name, kind.heading, words.get(name, ()), figures[name], kind.caption, shown[name])
        for name, kind in LIBRARY_FIGURES.items()
    ]
    return render_sections("The nine-condition library", f"circuit plant, seed {seed}", INTRODUCTION, sections)


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
        "valve, which no linear order describes, and with enough samples BIC buys poles for them. The library keeps "
        f"what BIC prefers among orders 1 and 2 whose poles and gain the data determine, order {kept}.",
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

    Returns
    -------
    tuple of str
        One sentence.
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


def _models(frame: pd.DataFrame) -> Markup:
    gain, spread = _fixed(MILLI * frame["dc_gain"], 4), _fixed(1.96 * MILLI * frame["dc_gain_std"], 4)
    low, high = (_fixed(MILLI * frame[f"published_gain_{end}"], 3) for end in ("low", "high"))
    shown = frame.assign(gain=gain + " ± " + spread, printed=low + " to " + high)
    columns = (
        CONDITION,
        Column("gain", "steady gain", "mm/s per rad/s, 95 %", words=lambda text: Cell(text, "number")),
        Column("printed", "Table 6", "mm/s per rad/s, by rounding", words=lambda text: Cell(text, "number")),
        Column("bandwidth_hz", "3 dB down", "Hz", digits=3),
        Column("published_bandwidth_hz", "Table 6", "Hz", digits=3),
        Column("jump_ratio", "b0 / gain", "ratio", digits=2),
        Column("published_jump_ratio", "Table 6", "ratio", digits=2),
        Column("fit_percent", "fit", "%", digits=3),
    )
    return html_table(
        shown, columns, "The library's models beside Table 6, whose digits leave gains open (errata E14)."
    )


def _fixed(values: pd.Series, decimals: int) -> pd.Series:
    return pd.Series([fixed(float(value), decimals) for value in values], index=values.index)


def _roots(frame: pd.DataFrame) -> Markup:
    rows: list[dict[str, str]] = []
    for condition, of_one in frame.groupby("condition", sort=False):
        row = {"condition": str(condition)}
        for (kind, source), roots in of_one.groupby(["kind", "source"]):
            row[f"{kind} {source}"] = "; ".join(_root(root) for root in roots.to_dict("records"))
        rows.append(row)
    columns = (
        CONDITION,
        *(Column(f"{kind} {source}", f"{kind}s, {source}") for kind in ("pole", "zero") for source in SOURCES),
    )
    caption = "Poles and zeros in z at 1 ms: ours ± one standard deviation, Table 6's ± what its rounding leaves open."
    return html_table(pd.DataFrame(rows), columns, caption)


def _root(root: Mapping[Any, Any]) -> str:
    text = f"{number(root['real'])} ± {number(root['real_spread'], 1)}"
    if abs(root["imag"]) > 0.0:
        text += f", {number(root['imag'])} i ± {number(root['imag_spread'], 1)}"
    return text


def _structures(frame: pd.DataFrame) -> Markup:
    behind, error = _fixed(frame["behind_percent"], 2), _fixed(frame["behind_std_percent"], 2)
    shown = frame.assign(behind=(behind + " ± " + error).where(~frame["best"], "best"))
    columns = (
        CONDITION,
        Column("order", "order", words=lambda order: Cell(str(order), "number")),
        Column("structure", "structure"),
        Column("fit_percent", "free run", "%"),
        Column(
            "behind",
            "behind the best",
            "points ± standard error",
            words=lambda t: Cell(t, "good" if t == "best" else "number"),
        ),
        Column("one_step_percent", "one step ahead", "%"),
        Column("weight_above_percent", "weight above 25 Hz", "%", digits=2),
        Column("dc_gain", "steady gain", "mm/s per rad/s", MILLI),
    )
    return html_table(
        shown, columns, "Fitted to two thirds of the passes, judged on the others, each pass from its own state."
    )


def _orders(frame: pd.DataFrame) -> Markup:
    plain: Callable[[int], Cell] = lambda order: Cell(str(order), "number")  # noqa: E731 - a shared cell writer
    columns = (
        CONDITION,
        Column("order_by_values", "order by singular values", words=plain),
        Column("order_by_bic", "order by BIC", words=plain),
        Column("order_of_library", "order kept", words=plain),
        *(Column(f"value_{k}_over_floor", f"value {k}", "over floor", digits=2) for k in (1, 2, 3)),
        *(Column(f"fit_{order}_percent", f"fit, order {order}", "%") for order in (1, 2, 3, 4)),
        Column("bandwidth_hz", "3 dB down", "Hz", digits=3),
        Column("bandwidth_std_hz", "± one deviation", "Hz", digits=1),
    )
    return html_table(frame, columns, "Order and break frequency by condition.")


def _clocks(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("input", "test"),
        *(
            Column(name, f"at {name.split('_')[1].removesuffix('.0')} Hz", "% of gain", 100.0, 2)
            for name in frame.columns
            if name.startswith("at_")
        ),
        Column("steady_state", "steady", "% of gain", 100.0, 2),
        Column("violations", "what it breaks", words=lambda text: text or "nothing"),
    )
    return html_table(frame, columns, "Predicted standard deviation of the gain, 20 s at the bench's velocity noise.")
