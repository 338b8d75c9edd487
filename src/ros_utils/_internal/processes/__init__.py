"""Processes and nodes: started, found, ended."""
