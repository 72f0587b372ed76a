"""The pages of campaigns.

Each page is one HTML file that opens without a network, with figures and replays of the worst rows.

Imports: batch, campaigns.analysis, campaigns.scenes, campaigns.store, campaigns.sweeps, controller,
io, plant_fmu, replay, report, report.figures, results, run, scenario, simulation.
"""
