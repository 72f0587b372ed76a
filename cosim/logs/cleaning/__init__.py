"""Cleaning of a log's samples: their clocks, their order, and what is no sample.

Imports: simulation.
"""
