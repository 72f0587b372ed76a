"""`check`: FMPy's validation of an FMU, and its simulation by FMPy and by `Plant`, each in a process of its own.

Imports: running, variables.
"""
