"""The robot's physics: scalar functions and small states, standard library only, so that an FMU can carry them anywhere."""
