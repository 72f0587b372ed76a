"""Compiled laws as portable C: a translator of the Python in which laws are written.

`program` translates functions with all that they call into one C99 file without heap, `types` says what C stands for
what Python, `expressions` and `statements` are the constructs one by one, `arguments` makes words of arrays and tuples.

Imports: errors, jit.
"""
