"""Logs of vehicles as runs.

A reader in `formats` writes the samples of a log to disk. Then `cleaning` joins clocks, drops repeats,
puts bursts on even times and marks gaps. The result becomes rows of a record. Public: `import_log`.

Imports: io, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation, simulation.commands.
"""

from cosim.logs.importing import import_log

__all__ = ["import_log"]
