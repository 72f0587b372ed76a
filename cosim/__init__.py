"""Co-simulation of an underwater vehicle: scenarios, the master, records, reports and telemetry."""
