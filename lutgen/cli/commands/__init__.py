"""The commands: one module for each command, found by its name; a folder is a group of commands.

A module declares ``command`` with its options, its section of the help and an example. A command reads options, calls
the library and writes results. ``lutgen/cli`` holds code that several commands share; the library holds all code that
other programs may use too.
"""
