"""The traffic between clients and the server: access, and the log of calls."""
