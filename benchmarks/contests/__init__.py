"""The contests with peers, a file for each subject: a function of the peers' environment that yields contests."""
