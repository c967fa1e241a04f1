"""Advice on the cylinder of a piezo actuator, whatever its pump."""

from plant.notes import Code


class CylinderAdviceCode(Code):
    """Advice on a cylinder that leaks or whose rod is hard to move."""

    LOOK_AT_PISTON_SEAL = "inspect the seal of the cylinder's piston"
    LOOK_AT_ROD = "inspect the rod seals, the guide and its alignment"
