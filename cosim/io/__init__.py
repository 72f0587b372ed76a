"""Files, JSON, and addresses.

Files that appear whole or not at all, JSON that any reader takes, and network addresses with a check whether other
machines reach them.

Imports: nothing.
"""
