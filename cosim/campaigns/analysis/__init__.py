"""Statistics of the rows of a campaign.

Rates with intervals, quantiles, effects of varied keys, and the worst rows.

Imports: campaigns.scenes, campaigns.store, simulation.
"""
