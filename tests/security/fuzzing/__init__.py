"""Every reader of the product, and changes of what it reads."""
