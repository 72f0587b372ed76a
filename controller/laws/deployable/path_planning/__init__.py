"""A path from the vehicle into the goal region: the planner that keeps one, its cost, and the search for another.

Imports: regions.
"""
