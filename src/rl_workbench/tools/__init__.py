"""The workbench around a training: look at runs, compare them, search options, train with SB3."""
