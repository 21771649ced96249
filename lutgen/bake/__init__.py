"""Baking of a display model into LUT files and OpenColorIO configs. Each file is certified against the model."""
