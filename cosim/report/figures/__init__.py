"""The figures of a report.

A module for each kind of figure, with a common style and a fixed layout. Figures are drawn from a bounded number of
rows of the record.

Imports: controller, replay, results, scenario, simulation, simulation.commands.
"""
