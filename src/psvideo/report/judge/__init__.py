"""Measurements in, judgements out: one line for each thing, with advice."""
