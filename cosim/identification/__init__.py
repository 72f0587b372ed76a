"""Vehicle parameters from recorded runs.

Windows of runs are predicted by the FMU's own equations, and compared with what sensors measured.

Imports: batch, plant_fmu.
"""
