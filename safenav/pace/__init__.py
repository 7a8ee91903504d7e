"""How long a robot's step takes, by its kind of motion; light enough for the runtime."""
