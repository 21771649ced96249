"""Baking: a display model into LUT files and OpenColorIO configs, each certified against the model."""
