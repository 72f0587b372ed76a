"""The model of a vehicle that a law receives."""

from __future__ import annotations

import numpy as np

from controller.driven_axes import passive_axes
from controller.law import VehicleModel
from plant_fmu.vehicle import Vehicle


def vehicle_model(vehicle: Vehicle) -> VehicleModel:
    """Return a vehicle's nominal model for a law, without weight, buoyancy and their centers."""
    # It has their righting moment where thrusters do not drive all axes, or would not with one of them lost.
    rigid_mass = np.zeros((6, 6))
    rigid_mass[:3, :3] = vehicle.mass * np.eye(3)
    rigid_mass[3:, 3:] = vehicle.inertia
    model = VehicleModel(
        rigid_mass=rigid_mass,
        added_mass=np.array(vehicle.added_mass, dtype=float),
        linear_damping=np.array(vehicle.linear_damping, dtype=float),
        quadratic_damping=np.array(vehicle.quadratic_damping, dtype=float),
        thruster_matrix=np.ascontiguousarray(vehicle.thruster_matrix, dtype=float),
        thrust_min=np.array(vehicle.thrust_min, dtype=float),
        thrust_max=np.array(vehicle.thrust_max, dtype=float),
        thrust_time_constant=vehicle.thrust_time_constant + vehicle.command_delay,  # a delay acts like more lag
        trim=np.array(vehicle.trim, dtype=float),
    )
    works = ~np.eye(vehicle.n_thrusters + 1, vehicle.n_thrusters, dtype=bool)
    left = passive_axes(model.thruster_matrix, model.thrust_min * works, model.thrust_max * works)
    if all(axes == [] for axes in left):
        return model
    return model._replace(righting_moment=vehicle.righting_moment)
