"""What people and CI see of a batch."""
