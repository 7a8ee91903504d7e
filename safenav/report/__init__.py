"""Output for people: terminal, pictures, pages."""
