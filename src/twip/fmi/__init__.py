"""From the declaration of a block to a complete FMI 2.0 co-simulation FMU, and from FMUs and wiring to an .ssp."""
