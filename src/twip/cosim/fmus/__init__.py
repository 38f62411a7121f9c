"""FMUs: their model descriptions, instances, processes and the moving of their values."""
