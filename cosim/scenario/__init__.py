"""Scenarios.

One TOML file holds all that a run depends on. This package reads it, validates each table with messages that name the
key, and makes the values from which the simulation starts. Public: `load_scenario`, `Scenario`, `list_scenarios`.

Imports: controller, fuzzy_arbiter, plant_fmu.
"""
