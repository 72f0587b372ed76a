"""What carries frames: one file a kind, behind one protocol."""
