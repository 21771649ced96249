"""The commands: one module for each command, found by its name; a folder is a group of commands.

A module declares ``command`` with its options, its section of the help and an example. It reads options, calls the
library and writes results; what two commands need is in ``lutgen/cli``, what a program would want too in the library.
"""
