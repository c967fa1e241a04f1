from pathlib import Path

import numpy as np
import pytest

from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError, LogError
from plant.export.fmu import plant_fmu
from plant.foreign_fmu import simulate_fmu
from plant.sensors.sensors import BENCH
from tests.c_compiler import compiler

P, T = EhaParameters(), 1e-3
DRIVE = sine(0.4, T, P.rated_speed, 5.0)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler("gcc")
    pytest.importorskip("fmpy", reason="FMPy is an extra")
    path = tmp_path_factory.mktemp("fmu") / "plant.fmu"
    path.write_bytes(plant_fmu(LUMPED, P, T, "2.0", name="plant"))
    return path


def test_an_fmu_runs_as_the_plant_it_is_made_of(fmu: Path) -> None:
    run, native = simulate_fmu(fmu, DRIVE, T), simulate(LUMPED, DRIVE, T, P)
    assert set(run) == set(native)
    assert np.array_equal(run["motor_speed_rad_s"], DRIVE)
    # the FMU holds the mean speed of each step, the native plant interpolates linearly
    for channel in ("position_m", "velocity_m_s", "differential_pressure_pa"):
        size = np.max(np.abs(native[channel]))
        assert 0.0 < np.max(np.abs(run[channel] - native[channel])) < 1e-3 * size


def test_variables_of_an_fmu_are_named_with_units_like_columns_of_a_log(fmu: Path) -> None:
    plain = simulate_fmu(fmu, DRIVE, T)
    named = simulate_fmu(fmu, DRIVE, T, columns={"position_m": "position_m:mm"})
    assert np.allclose(named["position_m"], 1e-3 * plain["position_m"], rtol=1e-12)
    slow = simulate_fmu(fmu, DRIVE, T, columns={"motor_speed_rad_s": "motor_speed_rad_s:rpm"})
    told = simulate_fmu(fmu, DRIVE * 60.0 / (2.0 * np.pi), T)
    assert np.allclose(slow["position_m"], told["position_m"], rtol=1e-9)


PUMP = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Pump(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.omega = self.x = 0.0
        self.register_variable(Real("omega", causality=Fmi2Causality.input))
        self.register_variable(Real("x", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        self.x += 0.05 * self.omega * step
        return True
"""


def test_an_fmu_of_another_exporter_runs_under_its_own_names_and_units(tmp_path: Path) -> None:
    builder = pytest.importorskip("pythonfmu", reason="pythonfmu is an extra of developers").FmuBuilder
    pytest.importorskip("fmpy", reason="FMPy is an extra")
    (tmp_path / "pump.py").write_text(PUMP)
    path = builder.build_FMU(str(tmp_path / "pump.py"), dest=str(tmp_path))
    columns = {"motor_speed_rad_s": "omega:rpm", "position_m": "x:mm"}
    run = simulate_fmu(Path(path), np.full(11, 10.0 * np.pi), 1e-2, columns=columns)
    assert list(run) == ["motor_speed_rad_s", "position_m"]
    assert run["position_m"][-1] == pytest.approx(1e-3 * 0.05 * 300.0 * 0.1)
    with pytest.raises(LogError, match="has inputs omega"):
        simulate_fmu(Path(path), np.ones(11), 1e-2)
    with pytest.raises(LogError, match="sensors with noise need velocity_m_s, differential_pressure_pa"):
        simulate_fmu(Path(path), np.ones(11), 1e-2, columns=columns, sensors=BENCH, rng=np.random.default_rng(0))


def test_an_fmu_runs_with_given_parameters_and_sensors(fmu: Path) -> None:
    soft = simulate_fmu(fmu, DRIVE, T, parameters={"bulk_modulus": 1e8})
    assert not np.allclose(soft["velocity_m_s"], simulate_fmu(fmu, DRIVE, T)["velocity_m_s"])
    noisy = simulate_fmu(fmu, DRIVE, T, sensors=BENCH, rng=np.random.default_rng(0))
    assert not np.array_equal(noisy["position_m"], simulate_fmu(fmu, DRIVE, T)["position_m"])


def test_an_invalid_fmu_or_argument_is_refused(fmu: Path, tmp_path: Path) -> None:
    (tmp_path / "no.fmu").write_text("none")
    with pytest.raises(HydrostateError, match="an FMU is needed"):
        simulate_fmu(tmp_path / "no.fmu", DRIVE, T)
    with pytest.raises(HydrostateError, match=r"absent\.fmu: an FMU is needed: No such file or directory"):
        simulate_fmu(tmp_path / "absent.fmu", DRIVE, T)
    with pytest.raises(HydrostateError, match="has no variable 'stiffness'"):
        simulate_fmu(fmu, DRIVE, T, parameters={"stiffness": 1.0})
    with pytest.raises(HydrostateError, match="needs rng"):
        simulate_fmu(fmu, DRIVE, T, sensors=BENCH)
    with pytest.raises(LogError, match="needs an input for motor_speed_rad_s"):
        simulate_fmu(fmu, DRIVE, T, columns={"motor_speed_rad_s": "velocity_m_s:rad/s"})
