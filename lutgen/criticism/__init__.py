"""Criticism of the model: compare it with measurements, diagnose what it lacks, refine it, plan what to do next."""
