"""What commands are made of: their options, the files they read and write, the terminal."""
