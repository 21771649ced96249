"""Baking of a display model into LUT files and OpenColorIO configs, and the check of a folder of such files.

``build`` and ``check`` are the two tasks. Every other file holds one step of them: the plan, the table of a LUT, the
text of a config, the reading back, the certificate, the manifest. ``formats`` holds one file for each file format.
"""
