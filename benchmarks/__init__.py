"""Benchmarks: what things cost, as figures and ratios. They assert nothing."""
