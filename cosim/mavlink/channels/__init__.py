"""Channels that carry frames.

UDP, TCP, serial lines and files, one kind in each module, behind one protocol.

Imports: nothing.
"""
