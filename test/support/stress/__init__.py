"""What the stress tests (test/stress) are made of: scenarios that are counted, and their table."""
