"""The report of a run.

Sentences, tables and figures as one HTML file, as PDF, or as pictures. Public: `write_report`.

Imports: controller, replay, results, scenario, simulation.
"""
