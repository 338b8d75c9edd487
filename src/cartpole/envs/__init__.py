"""Gymnasium environments of the cart-pole: one task, several plants that carry it out."""
