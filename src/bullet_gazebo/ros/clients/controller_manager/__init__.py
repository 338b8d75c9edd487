"""The programs and Python modules of package controller_manager, which talk to a running manager."""
