"""Simulated sessions with labelled causes, by physics alone: nothing but the scoring imports lutgen."""
