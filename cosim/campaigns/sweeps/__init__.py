"""Sweeps.

Designs that choose the values, and the rows that come of them.

Imports: batch, campaigns.analysis, campaigns.store, campaigns.workers, plant_fmu, results, scenario, simulation.
"""
