"""The user's own catkin packages and Python modules, found and built for `ws`. See __main__."""
