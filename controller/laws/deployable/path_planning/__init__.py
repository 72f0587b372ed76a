"""A path from the vehicle into the goal region: the planner that improves it, its cost, and the tree search.

Imports: regions.
"""
