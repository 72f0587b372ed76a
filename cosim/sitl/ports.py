"""Where autopilots look for their plant."""

PORTS = {"ardupilot": 9002, "px4": 4560}  # by backend: UDP, TCP
