"""What a robot looks like, in pictures, on pages and in a window; touches no physics."""
