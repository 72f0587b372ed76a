"""The contests with peers, one module per subject, with a function `contests` of the peers' environment."""
