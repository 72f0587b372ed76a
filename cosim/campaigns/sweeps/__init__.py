"""Sweeps.

Designs that choose the values, and their rows.

Imports: batch, campaigns.store, campaigns.workers, results, scenario.
"""
