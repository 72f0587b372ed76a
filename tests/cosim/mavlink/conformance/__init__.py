"""Checks, from the client's side, of what ground stations require of a vehicle."""
