"""Frames on links.

Endpoints, framing, signing, and links that number frames and limit their rate.

Imports: io, mavlink.channels.
"""
