"""Sensor architectures as data: files, checks, presets."""
