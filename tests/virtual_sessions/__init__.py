"""Simulated sessions with labelled causes, by physics alone: it does not import lutgen."""
