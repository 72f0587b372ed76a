"""Verbs of the ``cosim`` command that have a file of their own."""
