"""A run in the formats of other tools.

`formats` lists them with their writers, which are imported at their first use. Public: `export_run`.

Imports: controller, io, mavlink, mavlink.wire, plant_fmu, replay, results, simulation.
"""

from cosim.export.exporting import export_run

__all__ = ["export_run"]
