"""What all trainings share: folder, checkpoints, log, progress, evaluation."""
