"""Reading what a user gives: files, XML, TOML, archives, arguments; and telling what is wrong with it."""
