"""The figures of a report.

One kind of figure a file, with a common style and fixed layout. All draw from rows of the record that are few enough to
draw.

Imports: controller, replay, results, scenario, simulation, simulation.commands.
"""
