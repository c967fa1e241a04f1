"""Filters as FMUs for co-simulation: drives and measurements in, estimates with their deviations out."""

from estimation.engine.contract import FilterProblem
from estimation.export.c_filter import filter_in_c, numbers_of, row_notes
from plant.export.fmu import archive
from plant.export.fmu_description import ModelDescription, Variable
from plant.log.record import CHANNELS


def filter_fmu(problem: FilterProblem, method: str, fmi: str, *, name: str) -> bytes:
    """Return a filter as an FMU for co-simulation; a communication step is one sample.

    Parameters
    ----------
    problem : FilterProblem
        The task, for its model, channels, numbers and sampling.
    method : str
        One of `estimation.export.c_filter.EXPORTED`.
    fmi : str
        ``2.0`` or ``3.0``.
    name : str
        The model's identifier.

    Raises
    ------
    HydrostateError
        If method or version is not known, or the compiler does not do its work.
    """
    files = filter_in_c(problem, method, name=name)
    rows = [] if method == "imm" else numbers_of(problem, method)[0].tolist()
    told = row_notes(problem, method)
    variables = [
        Variable(row, unit, meaning, "parameter", value)
        for (row, unit, meaning), value in zip(told, rows, strict=method != "imm")
    ]
    variables += [
        Variable(f"{kind}_{one}" if kind else one, CHANNELS.get(one, "1"), f"{one}, {said}", "input", 0.0)
        for names, kind, said in (
            (problem.model.drives, "", "which drives the model"),
            (problem.channels, "measured", "measured; NaN is missing"),
        )
        for one in names
    ]
    for begin, said in (("estimated_", "estimated"), ("std_", "standard deviation of what is estimated")):
        variables += [
            Variable(f"{begin}{state.name}", state.unit, f"{state.name}, {said}", "output")
            for state in problem.model.states
        ]
    variables.append(Variable("gate", "1", "what speaks against the estimate, 0 for nothing", "output"))
    about = f"{method} on the {problem.model.name} form of the electro-hydrostatic actuator"
    model = ModelDescription(name, about, "", variables, problem.sample_time, interpolates=False)
    return archive(model, files, ("estimation", "export/templates", "fmu_filter.c", "filter"), fmi)
