"""Every reader of the product, and mutations of its input."""
