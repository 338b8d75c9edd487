"""Many machines: a cluster of Ray's, joined or started here."""
