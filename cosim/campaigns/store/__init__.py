"""The folder of a campaign.

Rows on disk: appended table by table, and joined at the end; and the plan with all inputs of the rows.

Imports: campaigns.workers, controller, fuzzy_arbiter, io, plant_fmu, simulation.
"""
