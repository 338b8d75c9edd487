"""The script itself: how it is run, seeded, and told apart from the libraries that it uses."""
