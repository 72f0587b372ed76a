"""Terms beyond straight lines: curves by name, values of Sugeno outputs, and the expressions that both are made of.

Imports: nothing.
"""
