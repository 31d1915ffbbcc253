"""What the model reads: frozen reports, each field with one line of explanation."""
