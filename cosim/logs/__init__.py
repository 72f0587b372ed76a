"""Logs of vehicles as runs.

A reader in `formats` puts what a log says on disk; clocks are aligned, held values and bursts undone, gaps marked; rows
of a record are made of that. Public: `import_log`.

Imports: controller, io, plant_fmu, results, run, scenario, simulation, simulation.commands.
"""

from cosim.logs.importing import import_log

__all__ = ["import_log"]
