"""Commands to a running vehicle.

The types of commands, and how they are applied between two steps, logged, and replayed from the log.

Imports: controller, plant_fmu, scenario.
"""
