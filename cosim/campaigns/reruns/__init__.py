"""One row of a campaign again.

The same to the last bit, and with everything recorded.

Imports: campaigns.scenes, campaigns.store, campaigns.sweeps, campaigns.workers, controller, io, plant_fmu, results,
run, scenario.
"""
