"""The commands of the command line, one per module: `declare(parser)` adds its options, `run(arguments)` does it."""
