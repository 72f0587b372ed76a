"""Flights of the companion with a real ArduSub on our plant, in simulated time, judged by the plant's own state."""
