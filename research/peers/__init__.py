"""Peers of `gripgen diagnose` on the campaigns of `research/blind`."""
