"""A run of the gear-pump actuator for `hydrostate simulate`: by a plant of this project or by another tool's FMU."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.actuator_kind import Options, Run
from experiments.command.options import PRESSURE, load_columns
from faults.conditions import LEVELS, find_condition, severity
from plant.eha.model import PARAMETER_NAMES, EhaParameters
from plant.errors import HydrostateError, require_known
from plant.notes import Code

if TYPE_CHECKING:
    import numpy as np

    from plant.arrays import Array
    from plant.eha.rig import Rig
    from plant.log.record import Record


class RunCode(Code):
    """Notes on a simulated run."""

    PRESSURE_NOT_LOGGED = "{channel} is not logged by these sensors: estimate and diagnose will be less certain"


def simulate_log(rig: "Rig[Any]", options: Options) -> Run:
    """Run a plant under a drive, in a condition, and return the sensors' log.

    Returns
    -------
    Run
        The log, with the settings that produced it.

    Raises
    ------
    HydrostateError
        If an option is unknown or contradicts another, or an FMU cannot be run or lacks what is wanted.
    """
    import numpy as np

    from plant.eha.drives import DRIVES, make_drive
    from plant.sensors.sensors import SENSORS as NOISE

    drive, sensors, seed = options["drive"], options["sensors"], options["seed"]
    require_known("--drive", drive, list(DRIVES))
    require_known("--sensors", sensors, list(NOISE))
    parameters, made_of = _faulty_actuator(rig.parameters, options)
    drive_rng, sensor_rng = np.random.default_rng(seed).spawn(2)
    speed = make_drive(drive, options["duration"], options["sample_time"], parameters, drive_rng)
    run = _run_plant if options["fmu"] is None else _run_fmu
    plant, record = run(rig.parameters, parameters, options, speed, sensor_rng)
    record = record.annotate(**made_of, drive=drive, rig=rig.name, seed=seed)
    said = {"plant": plant, **made_of, "drive": drive, "sensors": sensors, "seed": seed}
    return Run(record, said, () if PRESSURE in record else (RunCode.PRESSURE_NOT_LOGGED.note(channel=PRESSURE),))


def _run_plant(
    sound: EhaParameters, faulty: EhaParameters, options: Options, speed: "Array", rng: "np.random.Generator"
) -> "tuple[str, Record]":
    from plant.eha.simulate import PLANTS, simulate
    from plant.sensors.sensors import SENSORS as NOISE

    del sound
    for name in ("columns", "parameter"):
        if options[name]:
            raise HydrostateError(f"--{name} needs --fmu FILE; parameters of the actuator stand in its rig file")
    plant = options["plant"] if options["plant"] in PLANTS else "circuit"
    sensors = NOISE[options["sensors"]]
    return plant, simulate(PLANTS[plant], speed, options["sample_time"], faulty, sensors=sensors, rng=rng)


def _run_fmu(
    sound: EhaParameters, faulty: EhaParameters, options: Options, speed: "Array", rng: "np.random.Generator"
) -> "tuple[str, Record]":
    """Run an FMU; parameters that a condition changes are set if the FMU has a variable of that name."""
    from plant.foreign_fmu import fmu_variables, simulate_fmu
    from plant.sensors.sensors import SENSORS as NOISE

    path = Path(options["fmu"])
    if options["plant"] is not None:
        raise HydrostateError(f"--plant or --fmu is needed, got both: {options['plant']} and {path}")
    given = start_values(options["parameter"])
    changed = {name: getattr(faulty, name) for name in PARAMETER_NAMES if getattr(faulty, name) != getattr(sound, name)}
    lacking = sorted(set(changed) - fmu_variables(path)) if changed else []
    if lacking:
        raise HydrostateError(
            f"{path}: the condition changes {', '.join(lacking)}, and the FMU has no variables of these names: leave "
            "the condition out, and set the FMU's own by --parameter NAME=VALUE"
        )
    record = simulate_fmu(
        path,
        speed,
        options["sample_time"],
        columns=load_columns(options["columns"]),
        parameters=changed | given,
        sensors=NOISE[options["sensors"]],
        rng=None if options["sensors"] == "ideal" else rng,
    )
    return path.name, record


def start_values(texts: Sequence[str] | None) -> dict[str, float]:
    """Return ``--parameter`` as a mapping.

    Parameters
    ----------
    texts : sequence of str or None
        Texts ``NAME=VALUE``, with a name from the FMU.

    Returns
    -------
    dict[str, float]
        Values by name [each in the FMU's own unit].

    Raises
    ------
    HydrostateError
        If one is not of this form.

    Examples
    --------
    >>> start_values(["oil.bulk=1.5e9", "x0 = 0"])
    {'oil.bulk': 1500000000.0, 'x0': 0.0}
    """
    found: dict[str, float] = {}
    for text in texts or ():
        name, _, value = (part.strip() for part in text.rpartition("="))
        try:
            found[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise HydrostateError(f"--parameter NAME=VALUE with a number is needed, got {text!r}")
    return found


def _faulty_actuator(rig: EhaParameters, options: Options) -> tuple[EhaParameters, dict[str, Any]]:
    """Return the faulty actuator, and the fault that was set."""
    name, leakage, friction = (options[key] for key in ("condition", "leakage_severity", "friction_severity"))
    if leakage is None and friction is None:
        found = find_condition(name or "normal")
        name, leakage, friction = found.name, float(LEVELS.index(found.leakage)), float(LEVELS.index(found.friction))
    elif name is not None:
        raise HydrostateError("give either --condition or severities, not both")
    leaking, rubbing = leakage or 0.0, friction or 0.0
    made_of = {"condition": name, "leakage_severity": leaking, "friction_severity": rubbing}
    return severity(leaking, rubbing, rig), made_of
