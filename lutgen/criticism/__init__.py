"""Criticism of the model: compare it with measurements, diagnose missing effects, refine it, plan the next session."""
