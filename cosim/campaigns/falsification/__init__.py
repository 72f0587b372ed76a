"""Search for the worst scenes of a law, and estimate the probability of its violations.

Rows are flown as those of campaigns and sweeps are, but each depends on the results of earlier ones.

Imports: campaigns.analysis, campaigns.scenes, campaigns.store, campaigns.sweeps, campaigns.workers, plant_fmu,
scenario.
"""
