"""Episodes and fragments of them that are played on other machines."""
