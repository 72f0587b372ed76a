"""A replay that flies: plant, arbiter and law as WebAssembly in the page, and what of the scenario a reader may change."""
