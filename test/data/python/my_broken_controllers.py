raise RuntimeError("it has a fault at import")
