"""XML and YAML from anywhere: of any encoding, and made to exhaust whoever reads it.

A leaf: it imports nothing of this repository, no ROS and no engine, and may be imported everywhere.
"""
