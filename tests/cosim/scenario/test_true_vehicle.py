"""The vehicle with the plant's parameters laid over."""

import numpy as np

from cosim.scenario.scenario import load_scenario
from cosim.scenario.true_vehicle import true_model, true_vehicle


def changed(*overrides):
    return load_scenario("paper", [f"plant.parameters.{text}" for text in overrides])


def test_nothing_laid_over_is_the_vehicle_itself():
    scenario = load_scenario("paper")
    true = true_vehicle(scenario)
    for name, value in vars(scenario.vehicle).items():
        assert np.array_equal(getattr(true, name), value), name


def test_numbers_vectors_and_matrices_are_laid_over():
    scenario = changed("mass=130", "r_G.z=0.1", "inertia.xy=0.5", "weight=1300")
    true = true_vehicle(scenario)
    assert true.mass == 130.0 and true.r_G[2] == 0.1 and true.weight == 1300.0
    assert true.inertia[0, 1] == true.inertia[1, 0] == 0.5
    assert scenario.vehicle.inertia[0, 1] == 0.0


def test_elements_are_counted_from_one_and_failed_thrusters_have_no_force():
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


def test_what_is_no_number_of_the_vehicle_is_left_alone():
    assert true_vehicle(changed("bottom_depth=20", "dvl.rate=5")).mass == 125.0
