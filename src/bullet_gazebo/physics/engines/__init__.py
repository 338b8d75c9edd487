"""What an engine has to do, and the engines by name."""
