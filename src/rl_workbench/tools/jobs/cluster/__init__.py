"""Jobs on a cluster of Ray's: a task for each attempt, whose files come home as they are written."""
