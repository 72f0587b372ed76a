"""Seeing a run: what a page, a terminal or a live view needs to know of it, and the page."""
