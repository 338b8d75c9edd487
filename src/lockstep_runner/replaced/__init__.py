"""What is replaced for the script: one module for each library, `install` puts it in place."""
