"""Measuring cameras and lights beforehand: what a shoot's plan and rig file are to say."""
