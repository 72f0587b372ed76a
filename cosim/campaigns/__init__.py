"""Campaigns: many scenes flown by one law, resumable, and several laws compared on the same scenes."""

from cosim.campaigns.campaign import Campaign, run_campaign
from cosim.campaigns.comparison import Comparison, compare

__all__ = ["Campaign", "Comparison", "compare", "run_campaign"]
