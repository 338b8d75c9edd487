"""Options from flags, rosparams, KEY=VALUE and YAML."""
