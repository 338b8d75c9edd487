"""Pictures, videos and web pages of what is in a world: without a display, and without touching the world."""
