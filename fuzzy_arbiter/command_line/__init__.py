"""What the verbs of the command line do; it alone prints.

Imports: terms, engines, formats, export, pictures.
"""
