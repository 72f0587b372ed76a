"""A run from scenario to folder.

Claim the folder, step the master, write record, summary, report and replay; show progress meanwhile. Public:
`run_scenario`, `Run`, `RunFolder`.

Imports: controller, io, live, mavlink, plant_fmu, replay, report, results, scenario, simulation,
simulation.commands, ssp.
"""
