"""Programs that talk to a running simulator: spawn_model, spawner, gz, gzclient."""
