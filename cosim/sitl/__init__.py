"""A real autopilot flies the plant: the other side of ArduPilot's and PX4's simulators in the loop."""
