"""Vehicle parameters from recorded runs.

Windows of runs are predicted by the FMU's own equations, and compared with the sensors' measurements. Public:
`identify`, `Identification`.

Imports: controller, io, plant_fmu, report, report.figures, results, scenario, simulation, simulation.commands.
"""
