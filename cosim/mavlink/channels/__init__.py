"""What carries frames.

UDP, TCP, serial lines and files, one kind a file, behind one protocol.

Imports: nothing.
"""
