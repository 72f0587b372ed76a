"""Files, JSON, and addresses.

Atomic writes of files, strict JSON without NaN, and network addresses with a check whether they are loopback ones.

Imports: plant_fmu.
"""
