"""Output for people: terminal, pictures and pages."""
