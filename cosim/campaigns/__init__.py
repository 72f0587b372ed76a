"""Campaigns: many scenes flown by one law, or one scenario with numbers of it varied; resumable, on many cores."""

from cosim.campaigns.campaign import Campaign, run_campaign
from cosim.campaigns.comparison import Comparison, compare
from cosim.campaigns.design import Design, Vary, vary_from
from cosim.campaigns.sweep import Sweep, run_sweep

__all__ = ["Campaign", "Comparison", "Design", "Sweep", "Vary", "compare", "run_campaign", "run_sweep", "vary_from"]
