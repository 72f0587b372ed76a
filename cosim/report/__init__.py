"""The report of a run.

Sentences, tables and figures as one HTML file, and figures as SVG and PNG. Public: `write_report`.

Imports: controller, plant_fmu, replay, results, scenario, simulation, ssp.
"""
