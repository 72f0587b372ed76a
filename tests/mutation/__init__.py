"""Mutation test of the mathematics: every sign of controller and plant is turned once, and some test must notice."""
