"""What is done with trainings: looked at, filmed, compared, searched for options, run as many jobs."""
