"""Results of a run.

The record of signals and its writer, the summary that is computed from it, a comparison with the paper's claims, and
the wording of a run's outcome. Public: `load_record`, `Record`, `Recorder`.

Imports: controller, io, plant_fmu, scenario, simulation.
"""
