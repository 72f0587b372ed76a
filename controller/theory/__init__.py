"""The stability analysis of the paper's law, (30)-(45), as functions that show where it holds.

Imports: nothing.
"""

from controller.theory.conditions import (
    Fit,
    damping_fit,
    error_jacobian_bound,
    gain_fits,
    greatest_gradient,
    potential_fits,
    secondary_fit,
    sphere_radii,
)
from controller.theory.equations_of_motion import Model, coriolis, damping
from controller.theory.lyapunov import (
    bracket,
    lower_bound,
    mapped_error,
    mapped_error_rate,
    normalized_secondary,
    primary_value,
    printed_secondary,
    unit_gradient_secondary,
    value_rate,
)

__all__ = [
    "Fit",
    "Model",
    "bracket",
    "coriolis",
    "damping",
    "damping_fit",
    "error_jacobian_bound",
    "gain_fits",
    "greatest_gradient",
    "lower_bound",
    "mapped_error",
    "mapped_error_rate",
    "normalized_secondary",
    "potential_fits",
    "primary_value",
    "printed_secondary",
    "secondary_fit",
    "sphere_radii",
    "unit_gradient_secondary",
    "value_rate",
]
