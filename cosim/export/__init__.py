"""A run in the formats of other tools.

One format a file; each imports what it needs when it is asked for. Public: `export_run`, `FORMATS`.

Imports: controller, io, mavlink, mavlink.wire, plant_fmu, replay, results, scenario, simulation.
"""

from cosim.export.exporting import FORMATS, export_run

__all__ = ["FORMATS", "export_run"]
