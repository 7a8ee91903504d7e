"""Local worker processes, which run cases and can be killed."""
