"""The verbs of the command line; only this package prints.

Imports: terms, engines, formats, export, pictures.
"""
