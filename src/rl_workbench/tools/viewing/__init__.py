"""A run on a page in the browser: its curves, and episodes of its policies."""
