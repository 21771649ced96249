"""Simulated sessions with labelled causes, from physics alone: only the scoring imports lutgen."""
