"""Files shared with others: bounded reading of XML and YAML of unknown origin, and locks.

A leaf: it imports nothing of this repository, no ROS and no engine, and may be imported everywhere.

- `content`: reads a regular file within a bound of bytes.
- `xml_text`, `yaml_text`: parse text of any encoding, however large or nested it would become.
- `text`: one line for an error, and the name that was meant.
- `locks`: one process at a time in a folder.
- `limited`: a child process with bounds of time and memory.
- `expansion`: xacro in such a child.
"""

__all__ = ["content", "expansion", "limited", "locks", "text", "xml_text", "yaml_text"]
