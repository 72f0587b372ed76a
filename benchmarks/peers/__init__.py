"""Peers that ours is measured against. Each file stands alone: it runs in the peers' own environment.

A peer is a function of its setup, plain values, that returns a function which does as many items as it is told; where
that returns a number, it is what they took [s].
"""
