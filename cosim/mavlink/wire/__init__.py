"""Frames on links.

Endpoints, framing, signing, and links that number and limit what they send.

Imports: io, mavlink.channels.
"""
