"""The folder of a campaign.

Rows on disk: written part by part, merged, and joined at the end; and the plan with all inputs of the rows.

Imports: campaigns.workers, controller, fuzzy_arbiter, io, plant_fmu, simulation.
"""
