"""Model plugins: one module for each shared library of Gazebo's that has a stand-in here.

To add one, write a module with a class that takes a `PluginContext` and has a `shutdown()`, and with a table
`LIBRARIES` of file names and that class. Users' own plugins need no change here (docs/plugins.md).
"""
