"""What passes between clients and the server: who is let in, and what is noted of it."""
