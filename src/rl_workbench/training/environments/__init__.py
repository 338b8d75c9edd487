"""Gymnasium's environments, as agents want them."""
