"""The vehicle with the plant's parameter overrides applied."""

import numpy as np

from cosim.scenario.scenario import load_scenario
from cosim.scenario.true_vehicle import true_model, true_vehicle


def changed(*overrides):
    return load_scenario("paper", [f"plant.parameters.{text}" for text in overrides])


def test_without_overrides_the_true_vehicle_is_nominal():
    scenario = load_scenario("paper")
    true = true_vehicle(scenario)
    for name, value in vars(scenario.vehicle).items():
        assert np.array_equal(getattr(true, name), value), name


def test_scalar_vector_and_matrix_overrides_are_applied():
    scenario = changed("mass=130", "r_G.z=0.1", "inertia.xy=0.5", "weight=1300")
    true = true_vehicle(scenario)
    assert true.mass == 130.0 and true.r_G[2] == 0.1 and true.weight == 1300.0
    assert true.inertia[0, 1] == true.inertia[1, 0] == 0.5
    assert scenario.vehicle.inertia[0, 1] == 0.0


def test_element_indices_start_at_one_and_failed_thrusters_have_no_force():
    scenario = changed(
        "added_mass[1,5]=-3", "quadratic_damping[3]=99", "thrust_effectiveness[2]=0", "thrust_effectiveness[3]=0.5"
    )
    true = true_vehicle(scenario)
    assert true.added_mass[0, 4] == true.added_mass[4, 0] == -3.0
    assert true.quadratic_damping[2] == 99.0
    assert true.thrust_max[:4].tolist() == [27.0, 0.0, 13.5, 27.0]
    assert true.thrust_min[:4].tolist() == [-27.0, 0.0, -13.5, -27.0]
    model = true_model(scenario)
    assert model.mass[0, 4] == true.mass_matrix[0, 4]
    assert np.array_equal(model.phi, scenario.true_restoring_parameters)


def test_non_vehicle_parameters_are_ignored():
    assert true_vehicle(changed("bottom_depth=20", "dvl.rate=5")).mass == 125.0
