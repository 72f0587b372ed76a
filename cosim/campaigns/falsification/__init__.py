"""Search for scenes in which a law does worst, and estimate how rare its violations are.

Rows are flown as those of campaigns and sweeps are, but each follows from what came of those before.

Imports: campaigns.analysis, campaigns.scenes, campaigns.store, campaigns.sweeps, campaigns.workers, io, plant_fmu,
scenario.
"""
