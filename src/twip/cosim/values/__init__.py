"""Types, units, texts and what becomes of a value on its way."""
