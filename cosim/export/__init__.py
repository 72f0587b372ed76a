"""Runs in the formats of other tools: each in a file of its own, which imports what it needs."""

from cosim.export.exporting import FORMATS, export_run

__all__ = ["FORMATS", "export_run"]
