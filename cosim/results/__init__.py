"""What a run leaves.

The record of signals and its writer, the summary that is computed from it, what the paper claims beside it, and
sentences that say what happened. Public: `load_record`, `Record`, `Recorder`.

Imports: controller, io, plant_fmu, scenario, simulation.
"""
