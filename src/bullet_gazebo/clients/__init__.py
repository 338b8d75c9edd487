"""Programs that talk to a running simulator: spawn_model, spawner, controller_manager, gz, gzclient."""
