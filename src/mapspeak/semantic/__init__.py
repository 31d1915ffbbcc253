"""What is where, in words: remembered places and the file that holds them."""
