"""Model plugins: one module for each shared library of Gazebo's that has a stand-in here.

To add one, write a module with a class that takes a `PluginContext` and has a `shutdown()`, and name it in
`plugin_loader.BUILT_IN`. Users' own plugins need no change here (docs/plugins.md).
"""
