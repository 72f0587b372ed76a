"""The running co-simulation as a MAVLink vehicle."""
