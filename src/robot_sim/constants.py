"""Constants that several folders share."""

NANOSECONDS = 1_000_000_000  # in a second: simulated time is counted in them
