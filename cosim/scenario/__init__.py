"""What is to be run.

One TOML file holds all that a run depends on. This room reads it, validates each table with messages that name the key,
and makes the values that the simulation starts from. Public: `load_scenario`, `Scenario`, `shipped_scenarios`.

Imports: controller, fuzzy_arbiter, plant_fmu.
"""
