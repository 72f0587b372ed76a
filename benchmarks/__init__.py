"""Benchmarks: times and ratios. They assert nothing."""
