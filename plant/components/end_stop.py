"""End stops of the stroke."""

from plant.compiled.functions import Scalar, maximum


def end_stop_force(
    position: Scalar, velocity: Scalar, half_stroke: Scalar, stiffness: Scalar, damping: Scalar
) -> Scalar:
    """Return the force of the end stops on the piston; it is zero within the stroke.

    A spring whose damping is proportional to its compression: the force is continuous at contact, and energy is only
    lost. Source: Hunt and Crossley, ASME Journal of Applied Mechanics 42 (1975), page 440.

    Parameters
    ----------
    position : float or Expression
        Piston position from mid-stroke [m].
    velocity : float or Expression
        Piston velocity [m/s].
    half_stroke : float or Expression
        Travel from mid-stroke to either end [m].
    stiffness : float or Expression
        Stiffness of an end [N/m].
    damping : float or Expression
        Ratio of damping force to spring force, per unit of velocity [s/m].

    Returns
    -------
    float or Expression
        Force on the piston [N].

    Examples
    --------
    >>> round(float(end_stop_force(0.125 + 1e-5, 0.0, 0.125, 1e8, 20.0)))
    -1000
    """
    beyond = maximum(position - half_stroke, 0.0) - maximum(-position - half_stroke, 0.0)
    depth = maximum(position - half_stroke, 0.0) + maximum(-position - half_stroke, 0.0)
    return -stiffness * (beyond + damping * depth * velocity)
