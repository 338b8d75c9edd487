"""What a window needs of the world: the scene once, and where its links are."""
