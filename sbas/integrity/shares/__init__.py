"""Shares of time, such as availability, with intervals that respect correlation."""
