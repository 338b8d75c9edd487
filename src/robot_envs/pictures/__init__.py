"""Rendering: pictures, pages and windows; without physics."""
