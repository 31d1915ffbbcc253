"""Fit the judge of room borders to maps that people, or plans of drawn buildings, divided."""
