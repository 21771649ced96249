"""The version of lutgen: the one place that states it."""

__version__ = "0.1.0"
