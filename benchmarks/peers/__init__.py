"""Peers for comparison. Each file is independent of this project: it runs in the peers' own environment.

A peer is a function of its setup, plain values, that returns a function which does the given number of items; if
that returns a number, it is their time [s].
"""
