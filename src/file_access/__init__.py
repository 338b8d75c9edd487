"""Files shared with others: bounded reading of XML and YAML of unknown origin, and locks.

A leaf: it imports nothing of this repository, no ROS and no engine, and may be imported everywhere.
"""

__all__ = ["content", "expansion", "limited", "locks", "text", "xml_text", "yaml_text"]
