"""A run in the formats of other tools.

A format is a module of `formats`, which imports its dependencies at its first use. Public: `export_run`.

Imports: controller, io, plant_fmu, replay, results, scenario, simulation.
"""

from cosim.export.exporting import export_run

__all__ = ["export_run"]
