"""Rerun of a row of a campaign.

Once with the same engine, bit for bit, and once step by step with full record.

Imports: campaigns.scenes, campaigns.store, campaigns.sweeps, campaigns.workers, controller, io, plant_fmu, results,
run, scenario.
"""
