"""Many runs, resumable and on many cores.

Scenes flown by one law or by several, or one scenario with varied numbers. Public: `run_campaign`, `compare`,
`run_sweep`, `vary_from`.

Imports: batch, controller, io, plant_fmu, report, results, run, scenario, simulation.
"""
