"""Both forms in filterpy as its users write it: NumPy functions for model and Jacobian, one loop."""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from estimation.models.eha_forms import pressure_step
from plant.arrays import Array
from plant.eha.model import EhaParameters


class AccelerationFilter(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy carries no types
    """filterpy's filter plus the nonlinear prediction that it lacks (equations 7.1 to 7.4)."""

    def __init__(self, p: EhaParameters, step: float) -> None:
        super().__init__(dim_x=4, dim_z=2)
        self.p, self.step = p, step

    def predict_x(self, u: float = 0.0) -> None:
        """Advance the mean by one step at motor speed u."""
        self.F, self.x = self.linearised(self.x, u)

    def linearised(self, state: Array, u: float) -> tuple[Array, Array]:
        """Return the Jacobian and the state one step later; bulk modulus in 1e8 Pa."""
        p, T = self.p, self.step
        x, v, a, b = state
        A, L, M, a1, a2 = p.piston_area, p.leakage_coefficient, p.moving_mass, p.friction_quadratic, p.friction_linear
        s = np.sign(v)
        flow = np.sign(u) * max(abs(u) * p.pump_displacement - p.flow_bias, 0.0)
        friction = (a1 * v * v + p.friction_coulomb) * s + a2 * v
        gain = A * 1e8 / (M * p.chamber_volume)
        pull = gain * (flow - A * v - L / A * (friction + M * a))
        damping = (a2 + 2.0 * a1 * v * s) / M
        F = np.array(
            [
                [1.0, T, 0.0, 0.0],
                [0.0, 1.0, T, 0.0],
                [
                    0.0,
                    T * (b * gain * (-A - L / A * (a2 + 2.0 * a1 * v * s)) - 2.0 * a1 * s / M * a),
                    1.0 - T * (b * gain * L * M / A + damping),
                    T * pull,
                ],
                [0.0, 0.0, 0.0, 1.0],
            ]
        )
        return F, np.array([x + T * v, v + T * a, a + T * (b * pull - damping * a), b])


H = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])


def run(kalman: AccelerationFilter, speed: Array, measured: Array) -> None:
    """Filter a log: speed (n,), position and velocity (n, 2)."""
    for k in range(len(speed)):
        if k:
            kalman.predict(u=speed[k - 1])
        kalman.update(measured[k], HJacobian=lambda _: H, Hx=lambda x: H @ x)


class PressureFilter(ExtendedKalmanFilter):  # type: ignore[misc]  # filterpy carries no types
    """filterpy's filter on the pressure form: the plant's step in plain Python, its Jacobian by differences."""

    def __init__(self, p: EhaParameters, step: float, scale: Array) -> None:
        super().__init__(dim_x=4, dim_z=2)
        self.p, self.step, self.scale = p, step, scale

    def next_state(self, state: Array, speeds: tuple[float, float]) -> Array:
        """Return the scaled state one step later."""
        found = pressure_step(tuple((state * self.scale).tolist()), speeds, self.p, self.step)
        return np.array([float(one) for one in found]) / self.scale

    def predict_x(self, u: tuple[float, float] = (0.0, 0.0)) -> None:
        """Advance the mean by one step between two motor speeds."""
        here = self.next_state(self.x, u)
        self.F = np.column_stack([(self.next_state(self.x + 1e-6 * one, u) - here) / 1e-6 for one in np.eye(4)])
        self.x = here


def run_pressure(kalman: PressureFilter, speed: Array, measured: Array) -> None:
    """Filter a log: speed (n,), position and velocity (n, 2), both scaled."""
    speeds = speed.tolist()
    for k in range(len(speed)):
        if k:
            kalman.predict(u=(speeds[k - 1], speeds[k]))
        kalman.update(measured[k], HJacobian=lambda _: H, Hx=lambda x: H @ x)
