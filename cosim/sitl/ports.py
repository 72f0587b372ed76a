"""Default ports at which autopilots expect their simulator."""

PORTS = {"ardupilot": 9002, "px4": 4560}  # by backend: UDP, TCP
