"""The contests with peers, one module per subject.

A module has a function `contests` of the peers' environment; `sweeps` has an entry for `benchmarks.scaling`.
"""
