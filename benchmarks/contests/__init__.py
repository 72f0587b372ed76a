"""What is timed against peers, a file for each subject: a function of where the peers are, that yields contests."""
