"""The simulator's window: a page that this process serves to browsers."""
