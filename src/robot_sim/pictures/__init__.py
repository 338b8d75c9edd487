"""Pictures, videos and web pages of a world; needs no display and never changes the world."""
