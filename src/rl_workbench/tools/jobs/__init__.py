"""Many trainings as jobs: on this machine or on a cluster, skipped when done, resumed when half done."""
