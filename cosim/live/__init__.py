"""A run that is watched, and ordered about, while it goes on: in browsers, and in a terminal."""
