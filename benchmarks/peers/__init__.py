"""Peers for comparison. Each file is independent of this project: it runs in the peers' own environment.

A peer is a function of its setup, values from JSON. It returns a function that runs a given number of items; if that
returns a number, it is their time [s].
"""
