"""What the verbs of the command line do; it alone prints.

Imports: engines, export, formats, pictures, terms.
"""
