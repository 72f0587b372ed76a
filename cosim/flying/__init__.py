"""Flights without a record: one scenario in many variations, each flown in compiled code and told in one row."""
