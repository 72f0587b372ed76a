"""Numbers from the rows of a campaign.

Rates with intervals, quantiles, effects of what varies, and which rows deserve a look.

Imports: campaigns.scenes, campaigns.store, simulation.
"""
