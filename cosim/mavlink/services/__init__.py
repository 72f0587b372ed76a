"""The micro-services of the protocol, one file each."""
