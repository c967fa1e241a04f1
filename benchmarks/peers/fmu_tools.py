"""Runs an FMU of a plant in a tool other than FMPy. Needs ``libcosimpy`` (FMI Library, FMI 2.0) or ``ecospy`` (fmi4c).

``python fmu_tools.py TOOL FMU STEP < speeds.txt`` prints the velocity before the first step and after each, one on each
line.
"""

# its packages are in a separate environment
# pyright: basic, reportMissingImports=false

import sys


def by_ecos(path: str, step: float, speeds: list[float]) -> list[float]:
    """Return the velocities in Ecos [m/s]."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    with EcosSimulationStructure() as structure:
        structure.add_model("m", path)
        with EcosSimulation(structure=structure, step_size=step) as run:
            run.init()
            seen = [run.get_real("m::velocity_m_s")]
            for speed in speeds:
                run.set_real("m::motor_speed_rad_s", speed)
                run.step(1)
                seen.append(run.get_real("m::velocity_m_s"))
            run.terminate()
    return seen


def by_libcosim(path: str, step: float, speeds: list[float]) -> list[float]:
    """Return the velocities in libcosim [m/s]; it takes no step before inputs are set."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    run = CosimExecution.from_step_size(round(step * 1e9))
    place = run.add_local_slave(CosimLocalSlave(path, "m"))
    observer, inputs = CosimObserver.create_last_value(), CosimManipulator.create_override()
    run.add_observer(observer)
    run.add_manipulator(inputs)
    known = {one.name.decode(): one.reference for one in run.slave_variables(place)}
    seen = [0.0]
    for speed in speeds:
        inputs.slave_real_values(place, [known["motor_speed_rad_s"]], [speed])
        run.step()
        seen.append(observer.last_real_values(place, [known["velocity_m_s"]])[0])
    return seen


TOOLS = {"ecos": by_ecos, "libcosim": by_libcosim}

if __name__ == "__main__":
    tool, fmu, period = sys.argv[1:]
    found = TOOLS[tool](fmu, float(period), [float(line) for line in sys.stdin])
    print("\n".join(["velocities", *map(repr, found)]))
