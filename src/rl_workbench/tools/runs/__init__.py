"""Run folders and the policies in them."""
