"""Laws for comparison.

Each in a file, by the authors it is named after.

Imports: jit, regions.
"""
